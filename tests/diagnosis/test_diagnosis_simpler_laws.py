"""A law that is a case of another is told unless the data need the other; both are never tried together."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, answer_to, dataset_of, device, fit_of, measured, noise_drive, problem_of

from plant_sim.oscillator.mechanisms import MECHANISMS
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.elimination.simpler_laws import prefer_simpler_laws
from rtctl.diagnosis.search.model_selection import rank_hypotheses
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.search.state import SearchSettings

LAWS = "friction.coulomb,friction.stribeck,friction.presliding,damping.quadratic,damping.power"
LEVEL = (300.0, "mm/s^2")


def answer(folder: Path, identity: str, **values: tuple[float, str]) -> dict[str, Any]:
    """diagnosis.json of a device with this law."""
    parameters = {name: {"value": value, "unit": unit} for name, (value, unit) in values.items()}
    plant = device({"id": identity, "parameters": parameters})
    drives = ((noise_drive(11, 6.0), "fit"), (noise_drive(12, 9.0), "fit"), (noise_drive(13, 7.5), "test"))
    return answer_to(folder, [(drive, measured(plant, drive), use) for drive, use in drives], LAWS)


@pytest.mark.parametrize(
    ("identity", "values", "fitted"),
    [
        ("friction.coulomb", {"level": LEVEL}, {"level"}),
        pytest.param(
            "friction.coulomb", {"level": LEVEL, "transition_speed": (5.0, "mm/s")}, {"level", "transition_speed"},
            marks=pytest.mark.slow,
        ),
        pytest.param(  # below a hundredth of the velocity
            "friction.coulomb", {"level": LEVEL, "transition_speed": (0.6, "mm/s")}, {"level", "transition_speed"},
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "friction.stribeck",
            {"level": LEVEL, "excess": (200.0, "mm/s^2"), "transition_speed": (10.0, "mm/s")},
            {"level", "excess", "transition_speed"},
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "friction.presliding", {"level": LEVEL, "displacement": (0.1, "mm")}, {"level", "displacement"},
            marks=pytest.mark.slow,
        ),
        pytest.param("damping.quadratic", {"coefficient": (0.4, "1/mm")}, {"coefficient"}, marks=pytest.mark.slow),
        pytest.param(
            "damping.power",
            {"level": (600.0, "mm/s^2"), "exponent": (3.0, "dimensionless"), "speed": (50.0, "mm/s")},
            {"level", "exponent", "speed"},
            marks=pytest.mark.slow,
        ),
    ],
    ids=["ideal", "smooth", "sharp", "stribeck", "dahl", "square", "cube"],
)  # fmt: skip
@pytest.mark.slow
def test_each_law_is_told_by_its_own_name_and_no_more_of_it_than_acts(
    identity: str, values: dict[str, tuple[float, str]], fitted: set[str], tmp_path: Path
) -> None:
    found = answer(tmp_path, identity, **values)
    assert found["verdict"] == "explained"
    (cause,) = found["causes"]
    assert cause["id"] == identity
    assert cause["indistinguishable_from"] == []
    assert set(cause["parameters"]) == fitted
    for name in fitted - {"speed", "level"}:
        assert cause["parameters"][name]["value"] == pytest.approx(values[name][0], rel=0.2), name


def test_laws_are_related_where_one_is_a_case_of_the_other_or_both_have_one_in_common() -> None:
    coulomb, stribeck, dahl, square = (
        MECHANISMS[name]
        for name in ("friction.coulomb", "friction.stribeck", "friction.presliding", "damping.quadratic")
    )
    assert coulomb.is_related_to(stribeck)
    assert stribeck.is_related_to(coulomb)
    assert stribeck.is_related_to(dahl)
    assert not coulomb.is_related_to(square)


def test_a_shape_that_is_not_fitted_is_tried_at_its_simplest_and_then_it_is_done(tmp_path: Path) -> None:
    """Else a set that the data need is chosen in its own place, without end."""
    drive = noise_drive(11, samples=600)
    late_s = PERIOD_S * np.arange(600)
    reading = measured(device(), drive) + 0.5 * (1.0 - np.exp(-late_s / 0.1))
    problem = problem_of(dataset_of(tmp_path, (drive, reading, "fit")))
    nominal = fit_of(problem)
    extended = nominal.simulation.extended(("sensor.drift",))
    shape = "sensor.drift.settling_time"
    settling = np.array([0.1 if one.name == shape else one.value for one in extended.parameters])
    chosen = fit_hypothesis(
        problem, extended.with_values(settling), ("sensor.drift",), fixed_parameters=frozenset({shape})
    )
    assert chosen is not None
    tested = [run_residual_tests(one, problem, ("sensor.drift",)) for one in (nominal, chosen)]
    ranked = (rank_hypotheses(problem, [chosen], tested[1], plain=False),)
    found = SearchResult(tested[0], tested[1], True, (), ranked, (nominal, chosen))
    settings = SearchSettings(ids=("sensor.drift",), level=0.05, budget=WorkBudget.of(60.0))
    assert prefer_simpler_laws(problem, found, settings).chosen.hypothesis is chosen
