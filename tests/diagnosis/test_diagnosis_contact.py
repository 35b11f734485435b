"""Free play, stops, gravity, backlash and a moving base are named, and so are the causes that look like them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnosis_cases import MODEL, answer_to, cause, dataset_of, device, measured, noise_drive

from rtctl.api import diagnosing
from rtctl.border.errors import InputError
from rtctl.diagnosis.nominal_fit.misfit.segment_misfit import sort_by_segments
from rtctl.diagnosis.nominal_fit.whole_record_start import refit_from_segments
from rtctl.diagnosis.problem.bounds import parameter_bounds
from rtctl.diagnosis.problem.fit import fit_hypothesis, sensitivity_of
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.residual.directions import catalogue_directions
from rtctl.diagnosis.residual.shape_grid import shape_grid
from rtctl.identification.fit_record import select_fit_records
from rtctl.identification.scales import estimate_scales

RADIAN = np.degrees(2.0)
"""Degrees in a millimetre of a pendulum half a millimetre long."""
LEVELS = ((1, 6.0, "fit"), (2, 9.0, "fit"), (3, 7.5, "test"))
SPRINGS = (
    "stiffness.quadratic,stiffness.cubic,stiffness.quintic,stiffness.clearance,stop.one_sided,stop.two_sided"
)
DRIVES = "drive.deadband,drive.delay,drive.lag,actuator.backlash,stiffness.clearance,friction.coulomb"
Z, K = "mm", "1/s^2"
LOOSE = {"stiffness": (1.5e4, K), "lower": (-0.04, Z), "upper": (0.05, Z)}
CASES: list[tuple[str, dict[str, tuple[float, str]], str]] = [
    ("stiffness.clearance", {"gap": (0.04, Z), "centre": (0.3, "dimensionless")}, SPRINGS),
    ("stop.one_sided", {"above": (2e4, K), "place": (0.25, Z)}, SPRINGS),
    ("stop.one_sided", {"below": (1e4, K), "place": (-0.2, Z)}, SPRINGS),
    ("stop.one_sided", {"above": (2e4, K), "place": (0.25, Z), "retardation_time": (2e-3, "s")}, SPRINGS),
    ("stop.two_sided", {"stiffness": (2e4, K), "lower": (-0.35, Z), "upper": (0.25, Z)}, SPRINGS),
    ("stiffness.cubic", {"coefficient": (2e4, "1/(mm^2*s^2)")}, SPRINGS),
    ("stiffness.quadratic", {"coefficient": (1.5e3, "1/(mm*s^2)")}, SPRINGS),
    ("actuator.backlash", {"width": (0.9, "V")}, DRIVES),
    ("drive.deadband", {"width": (0.9, "V")}, DRIVES),
    ("drive.delay", {"delay": (0.003, "s")}, DRIVES),
    ("base.motion", {"cosine": (200.0, "mm/s^2"), "frequency": (11.3, "Hz")}, "base.motion,sensor.hum,mode.second"),
]  # fmt: skip


def records(*mechanisms: dict[str, Any], level: float = 1.0) -> list[tuple[Any, Any, str]]:
    """Two records to fit and one to test."""
    plant = device(*mechanisms)
    drives = [(noise_drive(seed, level * size), use) for seed, size, use in LEVELS]
    return [(drive, measured(plant, drive), use) for drive, use in drives]


SLOW = (
    "stiffness.cubic",
    "stop.two_sided",
    "stiffness.quadratic",
    "drive.delay",
    "drive.deadband",
    "actuator.backlash",
    "base.motion",
    "stop.one_sided",
)


@pytest.mark.parametrize(
    ("identity", "values", "rivals"),
    [
        pytest.param(
            *one, marks=[pytest.mark.slow] if one[0] in SLOW and "retardation_time" not in one[1] else []
        )
        for one in CASES
    ],
)
def test_it_is_named_among_those_that_look_like_it(
    tmp_path: Path, identity: str, values: dict[str, tuple[float, str]], rivals: str
) -> None:
    found = answer_to(tmp_path, records(cause(identity, **values)), rivals)
    assert found["verdict"] == "explained"
    assert [(one["id"], one["indistinguishable_from"]) for one in found["causes"]] == [(identity, [])]
    assert ("damper" in found["causes"][0]["statement"]) == ("retardation_time" in values)
    estimates = found["causes"][0]["parameters"]
    for name, (value, _) in values.items():
        assert (
            estimates[name]["low"] - 0.05 * abs(value) < value < estimates[name]["high"] + 0.05 * abs(value)
        )


def in_degrees(folder: Path) -> None:
    """Rewrite the case of a folder: what was mm are degrees."""
    for name in ("dataset.toml", "model.toml"):
        path = folder / name
        path.write_text(path.read_text().replace('"mm', '"deg'))


@pytest.mark.slow
@pytest.mark.parametrize("truth", ["stiffness.gravity", "stiffness.cubic"])
def test_a_pendulum_is_told_from_a_series_of_its_sine(truth: str, tmp_path: Path) -> None:
    """Half a millimetre is a radian; what is written are degrees."""
    gravity = {"coefficient": (1.2e4, K), "radian": (0.5, Z)}
    series = {"coefficient": (-4e3, "1/(mm^2*s^2)")}
    made = records(cause(truth, **(gravity if truth == "stiffness.gravity" else series)), level=0.35)
    turned = [(drive, displacement * RADIAN, use) for drive, displacement, use in made]
    dataset_of(tmp_path, *turned)
    (tmp_path / "model.toml").write_text(MODEL)
    in_degrees(tmp_path)
    model = (tmp_path / "model.toml").read_text().replace("430.0", f"{430.0 * RADIAN}")
    (tmp_path / "model.toml").write_text(model)
    found = diagnosing.diagnose(
        tmp_path / "dataset.toml", tmp_path / "model.toml",
        mechanisms="stiffness.gravity,stiffness.cubic,stiffness.quintic,stop.two_sided",
    )  # fmt: skip
    assert [(one.id, list(one.indistinguishable_from)) for one in found.causes] == [(truth, [])]


def test_gravity_is_not_looked_for_where_the_displacement_is_no_angle_and_asking_for_it_is_told_so(
    tmp_path: Path,
) -> None:
    data = dataset_of(tmp_path, *records())
    problem, model = problem_of(data), device()
    assert catalogue_directions(model, ("stiffness.gravity",), problem, [np.zeros((1, 9))]) == []
    with pytest.raises(InputError, match=r'"stiffness\.gravity" is for data whose displacement is in rad'):
        diagnosing.diagnose(
            tmp_path / "dataset.toml", tmp_path / "model.toml", mechanisms="stiffness.gravity"
        )


def problem_of(data: Any) -> Problem:
    """Its records to fit."""
    fits = select_fit_records(data)
    return Problem(subject=subject_of("oscillator"), records=fits, scales=estimate_scales(fits))


def test_stops_are_looked_for_where_the_motion_passes_and_stay_there(tmp_path: Path) -> None:
    """A place beyond the motion shows in no record, one behind all of it is an offset; one near its end shows."""
    problem = problem_of(dataset_of(tmp_path, *records()))
    read = np.concatenate([one.measured["displacement"] for one in problem.records])
    model = device().extended(("stop.one_sided", "stop.two_sided"))
    one_sided, two_sided = model.mechanisms
    for form, sign in (("above", 1.0), ("below", -1.0)):
        places = [one.values["place"] for one in shape_grid(one_sided, problem, [], form)]
        beyond = [np.mean(sign * read > sign * place) for place in places]
        assert max(beyond) == pytest.approx(0.6, abs=0.01)
        assert 0.0 < min(beyond) < 0.01
        fixed = frozenset({"stop.one_sided.below" if form == "above" else "stop.one_sided.above"})
        sensitivity = sensitivity_of(problem, model, fixed)
        names = [model.parameters[k].name for k in sensitivity.free]
        low, high = parameter_bounds(problem, sensitivity)
        at = names.index("stop.one_sided.place")
        inner, end = (min(places), read.max()) if sign > 0.0 else (max(places), read.min())
        bounds = sorted((inner, end))
        assert low[at] * sensitivity.scale[at] == pytest.approx(bounds[0])
        assert high[at] * sensitivity.scale[at] == pytest.approx(bounds[1])
    pairs = [(one.values["lower"], one.values["upper"]) for one in shape_grid(two_sided, problem, [])]
    assert len(pairs) == 16
    assert all(lower < np.median(read) < upper for lower, upper in pairs)


def test_stops_that_no_whole_record_leads_to_are_found_by_short_segments(tmp_path: Path) -> None:
    """A motion that bounces has a minimum at every turn: a fit of both stops ends above one of a cubic spring."""
    values = {"stiffness": 2e4, "lower": -0.35, "upper": 0.25}
    stops = cause("stop.two_sided", stiffness=(2e4, K), lower=(-0.35, Z), upper=(0.25, Z))
    problem = replace(problem_of(dataset_of(tmp_path, *records(stops))), steps_per_period=64.0)
    stuck = fitted_from(problem, "stop.two_sided", {"stiffness": 2.8e4, "lower": -0.49, "upper": 1.34}, 6)
    cubic = fitted_from(problem, "stiffness.cubic", {"coefficient": 2e4}, 40)
    assert cubic.cost < stuck.cost
    assert sort_by_segments(problem, [cubic, stuck])[0] is stuck
    found = refit_from_segments(problem, stuck)
    assert found.cost < 1e-3 * cubic.cost
    for name, value in values.items():
        (one,) = [one for one in found.simulation.parameters if one.name == f"stop.two_sided.{name}"]
        assert one.value == pytest.approx(value, rel=0.01)


def fitted_from(problem: Problem, identity: str, start: dict[str, float], iterations: int) -> Hypothesis:
    """The device with one mechanism, fitted to whole records from a spring that is as stiff as all of it."""
    model = device().extended((identity,))
    start = {"stiffness": 2.5e4} | {f"{identity}.{name}": value for name, value in start.items()}
    values = np.array([start.get(one.name, one.value) for one in model.parameters])
    fixed = frozenset({"stop.two_sided.retardation_time"})
    fit = fit_hypothesis(problem, model.with_values(values), (identity,), None, iterations, fixed)
    assert fit is not None
    return fit


def test_two_stops_may_be_in_the_midst_of_the_motion_as_those_of_a_loose_joint(tmp_path: Path) -> None:
    problem = problem_of(dataset_of(tmp_path, *records(cause("stop.two_sided", **LOOSE))))
    readings = np.concatenate([record.measured["displacement"] for record in problem.records])
    begins = dict(zip(("lower", "upper"), np.quantile(readings, (0.4, 0.6)).tolist(), strict=True))
    assert begins["lower"] < 1.2 * LOOSE["lower"][0], (
        "where the search's innermost stops are, outside of the true ones"
    )
    start = device(
        cause("stop.two_sided", stiffness=(1e4, K), lower=(begins["lower"], Z), upper=(begins["upper"], Z))
    )
    fit = fit_hypothesis(problem, start, ("stop.two_sided",))
    assert fit is not None
    values = {one.name: one.value for one in fit.simulation.parameters}
    for name, (value, _) in LOOSE.items():
        assert values[f"stop.two_sided.{name}"] == pytest.approx(value, rel=0.1)
