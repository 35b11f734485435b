"""A dead zone that every current exceeds is an offset of the current: it is told, and what else it may be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from vo2_model_cases import PERIOD_S, UNITS, predict, simulation, small_model, telegraph

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.diagnose import diagnose
from rtctl.diagnosis.result import Diagnosis
from rtctl.diagnosis.search.request import DiagnosisOptions
from rtctl.measured.dataset import Dataset, Record

IDS = ("actuation.deadband", "actuation.delay")


def answer(offset_mA: float) -> Diagnosis:
    """Diagnose records of the small model with an offset of the current."""
    records = []
    for seed, use in ((1, "fit"), (2, "fit"), (3, "test")):
        levels = telegraph(500, seed)
        acting = Stimulus(
            inputs={"current": levels + offset_mA}, holds={"current": "zero"}, period_s=PERIOD_S
        )
        resistance, deflection = predict(simulation(), acting)
        draw = np.random.default_rng([seed, 1])
        signals = {
            "current": levels,
            "resistance": resistance * np.exp(2e-3 * draw.normal(size=len(levels))),
            "deflection": deflection + 0.05 * draw.normal(size=len(levels)),
        }
        records.append(Record(name=f"r{seed}", use=use, period_s=PERIOD_S, signals=signals))
    data = Dataset(
        path=Path("dataset.toml"), name="offset", plant="vo2", units=UNITS, holds={"current": "zero"},
        records=tuple(records),
    )  # fmt: skip
    return diagnose(data, small_model(), simulation(), IDS, DiagnosisOptions(threads=1))


@pytest.mark.parametrize(
    ("offset_mA", "same"), [(-0.6, ("actuation.deadband",)), (0.6, ())], ids=["below zero", "above zero"]
)
def test_an_offset_without_which_the_error_returns_is_a_cause(
    offset_mA: float, same: tuple[str, ...]
) -> None:
    found = answer(offset_mA)
    assert found.verdict == "explained"
    cause = found.causes[0]
    assert (cause.id, cause.kind) == ("parameter.current_offset", "parameter")
    assert cause.parameters["current_offset"].value == pytest.approx(offset_mA, abs=0.03)
    assert cause.indistinguishable_from == same
    assert found.gain is not None
    assert found.gain.ratio_low > 2.0
    assert found.model.corrections["current_offset"].value == pytest.approx(offset_mA, abs=0.03)
    assert not any("the re-fit changed current_offset" in warning for warning in found.warnings)


def test_an_offset_of_the_size_of_identification_errors_is_none() -> None:
    assert answer(-0.003).verdict == "adequate"
