"""Outputs that take an input at once, read just before or just after a held input jumps at a row."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import rtctl
from rtctl import Record
from rtctl.border.arrays import FloatArray

MODEL = """
[model]
kind = "equations"
[model.inputs]
u = { unit = "V" }
room = { unit = "V" }
[model.states]
x = { unit = "V", rate = "(u + room - x)/tau", initial = 0.0, fixed = true }
[model.terms]
over = { unit = "V", value = "u + room - x" }
[model.outputs]
current = { unit = "mA", value = "over/resistance" }
level = { unit = "V", value = "x" }
[model.parameters]
tau = { value = 0.01, unit = "s", low = 0 }
resistance = { value = 200.0, unit = "ohm", low = 0 }
"""
PERIOD_S, TAU_S, RESISTANCE = 2e-3, 0.013, 150.0


def course(u: FloatArray, side: str) -> tuple[FloatArray, FloatArray]:
    """Return the current [mA] and the level [V] at the rows, exactly."""
    x = np.zeros(len(u))
    for k in range(1, len(u)):
        x[k] = u[k - 1] + (x[k - 1] - u[k - 1]) * np.exp(-PERIOD_S / TAU_S)
    seen = u if side == "after" else np.append(u[:1], u[:-1])
    return 1e3 * (seen - x) / RESISTANCE, x


@pytest.mark.parametrize("side", ["before", "after"])
def test_a_current_through_a_resistor_is_read_on_the_side_that_its_readings_show(
    side: str, tmp_path: Path
) -> None:
    (tmp_path / "model.toml").write_text(MODEL)
    random = np.random.default_rng(4)
    records = []
    for name, use in (("one", "fit"), ("two", "test")):
        u = np.repeat(random.uniform(-2.0, 2.0, 150), 3)
        current, level = course(u, side)
        signals = {
            "u": u, "room": np.zeros(len(u)),
            "current": current + 0.01 * random.standard_normal(len(u)),
            "level": level + 0.01 * random.standard_normal(len(u)),
        }  # fmt: skip
        records.append(Record(name=name, period_s=PERIOD_S, use=use, signals=signals))
    data = rtctl.write_dataset(
        tmp_path / "data", records, name="rc", plant="equations", holds={"u": "zero", "room": "zero"},
        units={"u": "V", "room": "V", "current": "mA", "level": "V"},
    )  # fmt: skip
    assert data.records[0].after_jumps == (frozenset({"current"}) if side == "after" else frozenset())
    said = [
        one for one in data.remarks if one.startswith("current: its rows are read just after the jumps of u")
    ]
    assert len(said) == int(side == "after")
    found = rtctl.identify(data, model=tmp_path / "model.toml")
    assert found.parameters["tau"].value == pytest.approx(TAU_S, rel=0.01)
    assert found.parameters["resistance"].value == pytest.approx(RESISTANCE, rel=0.01)
    run = rtctl.simulate(found.model, data).records["two"]
    current, _ = course(records[1].signals["u"], side)
    assert np.abs(run.simulated["current"] - current).max() < 0.01 * np.abs(current).max()
