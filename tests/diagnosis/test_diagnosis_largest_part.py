"""Where no set explains the data, the largest part is named where test records bear it out, and the rest is located."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from diagnosis_cases import FRICTION, answer_to, device, measured, noise_drive

from rtctl.diagnosis.search.largest_part import choose_largest_part
from rtctl.diagnosis.thresholds import Thresholds

DRIFT = {"id": "stiffness.drift", "parameters": {"rate": {"value": 150.0, "unit": "1/s^3"}}}
CUBIC = {"id": "stiffness.cubic", "parameters": {"coefficient": {"value": 2e4, "unit": "1/(mm^2*s^2)"}}}


def answer(folder: Path, hidden: list[dict[str, object]], ids: str) -> dict[str, object]:
    records = []
    for seed, use in ((1, "fit"), (2, "fit"), (3, "test")):
        drive = noise_drive(seed, 9.0)
        records.append((drive, measured(device(*hidden), drive), use))
    return answer_to(folder, records, ids)


@pytest.mark.parametrize(
    "others",
    [
        pytest.param("stiffness.cubic", marks=pytest.mark.slow),
        pytest.param("stiffness.cubic,damping.quadratic,hysteresis.bouc_wen", marks=pytest.mark.slow),
    ],
)
def test_friction_is_named_beside_what_no_law_on_offer_is(tmp_path: Path, others: str) -> None:
    """The stiffness drifts besides, which the catalogue that is tried does not have."""
    found = answer(tmp_path, [FRICTION, DRIFT], f"friction.coulomb,{others}")
    assert found["verdict"] == "partly_explained"
    (cause,) = found["causes"]
    assert cause["id"] == "friction.coulomb"
    assert cause["probability"] is None
    assert cause["indistinguishable_from"] == []
    assert 0.5 < cause["share_removed"] < 0.9
    assert found["gain"]["before"] > 1.5 * found["gain"]["after"]
    assert any("goes with time (100%)" in one for one in found["warnings"])


@pytest.mark.slow
def test_a_look_alike_is_not_named_where_a_law_of_no_name_explains_more(tmp_path: Path) -> None:
    """Friction and a cubic spring, of which the catalogue that is tried has the fifth order alone."""
    found = answer(tmp_path, [FRICTION, CUBIC], "friction.coulomb,stiffness.quintic")
    assert (found["verdict"], found["causes"]) == ("unexplained", [])
    assert any("a nonparametric alternative leaves a smaller residual" in one for one in found["warnings"])
    assert any(
        "stiffness.quintic comes nearest" in one and "% of the squared error" in one
        for one in found["warnings"]
    )


def test_a_set_with_loops_that_were_refitted_behind_it_stays() -> None:
    """A single cause without those loops is another model than the one that is handed out."""

    def of_cost(cost: float) -> Any:
        return SimpleNamespace(hypothesis=SimpleNamespace(cost=cost), p_value=0.0)

    result: Any = SimpleNamespace(
        nominal=of_cost(1.0), chosen=of_cost(0.6), passes=False, is_part=False, rankings=((of_cost(0.7),),),
        hysteresis_refit=object(),
    )  # fmt: skip
    tests: Any = (SimpleNamespace(),)
    problem: Any = SimpleNamespace(thresholds=Thresholds(), subject=SimpleNamespace(least_share_removed=0.9))
    assert choose_largest_part(result, problem, tests, ()) is result
