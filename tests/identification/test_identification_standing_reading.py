"""A displacement that stands far from zero: a sensor's stand-off, or a well that a bistable device rests in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from oscillator_cases import DUFFING, HM, UNITS, oscillator, record_of

import rtctl
from rtctl.measured.dataset import Record


def written(
    folder: Path, values: dict[str, float], level: float, rest_mm: float, stand_off_mm: float
) -> Path:
    """Two records of a device that rests at `rest_mm`, read by a sensor that is `stand_off_mm` away."""
    simulation, records = oscillator(values), []
    for seed, use in ((1, "fit"), (2, "test")):
        drive = level * np.repeat(np.random.default_rng(seed).uniform(-1.0, 1.0, 200), 10)
        one = record_of(simulation, drive, 1000.0, 0.0005, seed, initial=(rest_mm, 0.0))
        signals = {"drive": drive, "displacement": one.measured["displacement"] + stand_off_mm}
        records.append(Record(name=f"r{seed}", period_s=0.001, use=use, signals=signals))
    units = {name: UNITS[name] for name in ("drive", "displacement")}
    return rtctl.write_dataset(
        folder, records, name="made", plant="oscillator", units=units, holds={"drive": "linear"}
    ).path


def test_a_stand_off_is_the_zero_of_the_sensor(tmp_path: Path) -> None:
    """Before, the model was a well 32.4 mm from zero, and a diagnosis named three causes that were not there."""
    linear = {**DUFFING, "stiffness_cubic": 0.0}
    fit = rtctl.identify(written(tmp_path, linear, 2.0, 0.0, 32.4))
    assert fit.parameters["sensor.offset.offset"].value == pytest.approx(32.4, abs=1e-3)
    assert fit.parameters["stiffness"].value == pytest.approx(DUFFING["stiffness"], rel=1e-3)
    assert any("the displacement stands at 32.4" in note for note in fit.warnings), fit.warnings


def test_of_a_stand_off_that_a_deep_well_fits_as_well_both_are_told(tmp_path: Path) -> None:
    linear = {**DUFFING, "stiffness_cubic": 0.0}
    fit = rtctl.identify(written(tmp_path, linear, 2.0, 0.0, 5000.0))
    assert any("A sensor whose zero is elsewhere fits about as well" in note for note in fit.warnings), (
        fit.warnings
    )


def test_a_well_is_a_well(tmp_path: Path) -> None:
    """HM rests 6.96 mm from the middle of its beam, and moves little there."""
    rest = float(np.sqrt(-HM["stiffness"] / HM["stiffness_cubic"]))
    fit = rtctl.identify(written(tmp_path, HM, 0.5, rest, 0.0))
    assert "sensor.offset.offset" not in fit.parameters
    assert fit.parameters["stiffness"].value == pytest.approx(HM["stiffness"], rel=0.05)
