"""`rtctl simulate` says of a record whose free run cannot be predicted that its error tells little of the model."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import rtctl
from rtctl import Record
from rtctl.cli import main

MODEL = """[model]
kind = "oscillator"
[model.parameters]
damping = {{ value = 1.0, unit = "1/s" }}
stiffness = {{ value = {stiffness}, unit = "1/s^2" }}
stiffness_cubic = {{ value = {cubic}, unit = "1/(mm^2*s^2)" }}
drive_gain = {{ value = 100.0, unit = "mm/(s^2*V)" }}
"""


@pytest.mark.parametrize(
    ("stiffness", "cubic", "told"),
    [(-100.0, 100.0, True), (100.0, 0.0, False)],
    ids=["double well", "linear"],
)
def test_two_runs_that_part_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], stiffness: float, cubic: float, told: bool
) -> None:
    rng = np.random.default_rng(4)
    drive = np.repeat(rng.normal(size=600), 5)
    record = Record(
        name="r", period_s=0.02, use="test", signals={"drive": drive, "displacement": rng.normal(size=3000)}
    )
    data = rtctl.write_dataset(
        tmp_path, [record], name="r", plant="oscillator", units={"drive": "V", "displacement": "mm"}
    )
    model = tmp_path / "model.toml"
    model.write_text(MODEL.format(stiffness=stiffness, cubic=cubic), encoding="utf-8")
    command = ["simulate", str(model), str(data.path), "--out", str(tmp_path / "out"), "--no-plot"]
    assert main(command) == 0
    said = capsys.readouterr().out
    assert ("note: record r: its free run cannot be predicted" in said) is told
    growth = json.loads((tmp_path / "out" / "summary.json").read_text())["records"][0]["growth"]
    assert (growth > 1e4) is told
