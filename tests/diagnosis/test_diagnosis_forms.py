"""A mechanism of several forms: each is looked for by itself, and the answer says which one it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import device, measured, noise_drive, write_case

from rtctl.diagnosis.diagnose import diagnose
from rtctl.diagnosis.problem.fit import fit_hypothesis, polish
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.screening.split import split_records
from rtctl.diagnosis.search.proposals.candidates import propose_candidates
from rtctl.identification.scales import estimate_scales
from rtctl.measured import open_dataset, read_dataset
from rtctl.session.validation.model_validation import simulation_for


def second_mode(
    frequency_hz: float, damping_ratio: float, **amplitude: tuple[float, str]
) -> dict[str, object]:
    """The mechanism in the form of its one amplitude."""
    values = {"frequency": (frequency_hz, "Hz"), "damping_ratio": (damping_ratio, "dimensionless")}
    tables = {name: {"value": value, "unit": unit} for name, (value, unit) in (amplitude | values).items()}
    return {"id": "mode.second", "parameters": tables}


CARRIED = second_mode(26.0, 0.03, mass_ratio=(0.02, "dimensionless"))
BESIDE = second_mode(41.0, 0.02, gain=(60.0, "mm/s^2/V"))


def case(folder: Path, mechanism: dict[str, object]) -> Path:
    """Two records to fit and one to test on."""
    drives = [noise_drive(seed) for seed in (1, 2, 3)]
    uses = ("fit", "fit", "test")
    return write_case(
        folder,
        [(drive, measured(device(mechanism), drive), use) for drive, use in zip(drives, uses, strict=True)],
    )


@pytest.mark.parametrize(
    ("hidden", "other", "words"),
    [
        pytest.param(CARRIED, "gain", "A mass on the device, 0.0", marks=pytest.mark.slow),
        pytest.param(BESIDE, "mass_ratio", "A second mode at 41 Hz is driven too", marks=pytest.mark.slow),
    ],
    ids=["carried", "beside"],
)  # fmt: skip
def test_the_form_that_acts_is_found_and_the_other_stays_out(
    hidden: dict[str, object], other: str, words: str, tmp_path: Path
) -> None:
    path = case(tmp_path, hidden)
    model = tmp_path / "model.toml"
    found = diagnose(
        read_dataset(path), subject_of("oscillator").read_model(model), simulation_for(model, open_dataset(path)),
        ("stiffness.cubic", "mode.second", "drive.lag"),
    )  # fmt: skip
    (cause,) = found.causes
    assert cause.id == "mode.second"
    assert cause.statement.startswith(words)
    assert "?" not in cause.statement
    assert other not in cause.parameters
    extended = found.model.model.mechanisms[0].parameters
    assert set(extended) == set(hidden["parameters"])  # type: ignore[call-overload]
    for name, given in hidden["parameters"].items():  # type: ignore[attr-defined]
        assert cause.parameters[name].value == pytest.approx(given["value"], rel=0.1), name


def test_a_fit_of_one_form_begins_and_stays_without_the_other(tmp_path: Path) -> None:
    records, _, _ = split_records(read_dataset(case(tmp_path, CARRIED)), subject_of("oscillator"))
    problem = Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )
    nominal = fit_hypothesis(problem, device(), ())
    assert nominal is not None
    made = propose_candidates(
        run_residual_tests(nominal, problem, ("mode.second",)), problem.thresholds.search
    )
    assert {candidate.form for candidate in made} == {"gain", "mass_ratio"}
    for candidate in made:
        (other,) = {"gain", "mass_ratio"} - {candidate.form}
        values = {one.name: one.value for one in candidate.simulation.parameters}
        assert values[f"mode.second.{other}"] == 0.0
        assert f"mode.second.{other}" in candidate.fixed_parameters
        assert f"mode.second.{candidate.form}" not in candidate.fixed_parameters


def test_a_shape_is_freed_where_others_cannot_be_told_apart(tmp_path: Path) -> None:
    """Two names of one cubic spring say the same; the hum's frequency has nothing to do with them."""
    hum = {
        "id": "sensor.hum",
        "parameters": {
            "cosine": {"value": 0.1, "unit": "mm"}, "sine": {"value": 0.05, "unit": "mm"},
            "frequency": {"value": 50.4, "unit": "Hz"},
        },
    }  # fmt: skip
    path = write_case(tmp_path, [(noise_drive(5), measured(device(hum), noise_drive(5)), "fit")])
    records, _, _ = split_records(read_dataset(path), subject_of("oscillator"))
    problem = Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )
    fixed_parameters = frozenset({"sensor.hum.frequency"})
    cubic = {"id": "stiffness.cubic", "parameters": {"coefficient": {"value": 1.0, "unit": "1/(mm^2*s^2)"}}}
    twice = device(cubic, hum, stiffness_cubic=(1.0, "1/(mm^2*s^2)"))
    near = twice.with_values(
        np.array([50.3 if one.name in fixed_parameters else one.value for one in twice.parameters])
    )
    begun = fit_hypothesis(
        problem, near, ("stiffness.cubic", "sensor.hum"), fixed_parameters=fixed_parameters
    )
    assert begun is not None
    end = polish(problem, begun)
    assert end is not None
    assert end.fixed_parameters == frozenset()
    found = {one.name: one.value for one in end.simulation.parameters}
    assert found["sensor.hum.frequency"] == pytest.approx(50.4, abs=0.02)


def test_a_shape_that_only_names_the_others_unit_stays(tmp_path: Path) -> None:
    """Away from the optimum slopes by differences seem to tell Bouc-Wen's four numbers apart."""
    hysteresis = {
        "id": "hysteresis.bouc_wen",
        "parameters": {
            "level": {"value": 900.0, "unit": "mm/s^2"}, "displacement": {"value": 0.08, "unit": "mm"},
            "loop": {"value": 0.5, "unit": "dimensionless"}, "bend": {"value": 0.2, "unit": "dimensionless"},
        },
    }  # fmt: skip
    path = write_case(tmp_path, [(noise_drive(5), measured(device(hysteresis), noise_drive(5)), "fit")])
    records, _, _ = split_records(read_dataset(path), subject_of("oscillator"))
    problem = Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )
    names = [f"hysteresis.bouc_wen.{name}" for name in ("loop", "bend")]
    near = device(hysteresis)
    begun = fit_hypothesis(
        problem, near, ("hysteresis.bouc_wen",), fixed_parameters=frozenset(names), iterations=2
    )
    assert begun is not None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rtctl.diagnosis.problem.fit._is_identifiable", lambda *of: True)
        end = polish(problem, begun)
    assert end is not None
    assert end.fixed_parameters == {"hysteresis.bouc_wen.loop"}
    found = {one.name: one.value for one in end.simulation.parameters}
    assert found["hysteresis.bouc_wen.loop"] == 0.5
    assert found["hysteresis.bouc_wen.bend"] != 0.2
