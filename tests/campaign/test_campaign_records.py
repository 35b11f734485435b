"""A campaign over a model's parameters against measured records: the least error is at the record's own values."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.dataset as ds
import pytest

from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Stimulus
from rtctl.cli import main
from rtctl.models.provenance import write_checked_model
from rtctl.wiring_models import build_simulation

TRUTH = {"damping": (4.0, "1/s"), "stiffness": (9000.0, "1/s^2"), "drive_gain": (300.0, "mm/s^2/V")}
MANIFEST = """
[dataset]
name = "small"
plant = "oscillator"

[signals.drive]
role = "input"
unit = "V"

[signals.displacement]
role = "output"
unit = "mm"

[[records]]
file = "r.csv"
sample_rate_hz = 1000.0
"""
CAMPAIGN = """
[campaign]
title = "error over two parameters"
model = "model.toml"
outputs = ["rms_error", "nrmse"]
part = 64

[records]
dataset = "dataset.toml"

[design]
kind = "grid"

[factors.stiffness]
low = "8500 1/s^2"
high = "9500 1/s^2"
count = 21

[factors.damping]
low = "2 1/s"
high = "6 1/s"
count = 9

[picture]
kind = "basins"
x = "stiffness"
y = "damping"
show = "nrmse"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    parameters = {name: {"value": value, "unit": unit} for name, (value, unit) in TRUTH.items()}
    model = ModelFile.model_validate({"model": {"kind": "oscillator", "parameters": parameters}})
    write_checked_model(tmp_path / "model.toml", model)
    simulation = build_simulation(model, {"drive": "V", "displacement": "mm"}, "test")
    drive = np.random.default_rng(1).standard_normal(800)
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=1e-3)
    own = np.array([one.value for one in simulation.parameters])
    moved = simulation.predict(stimulus, own).outputs["displacement"][0]
    rows = np.column_stack([drive, moved])
    np.savetxt(tmp_path / "r.csv", rows, delimiter=",", header="drive,displacement", comments="", fmt="%.17g")
    (tmp_path / "dataset.toml").write_text(MANIFEST)
    return tmp_path


def sweep(folder: Path, text: str, out: str = "out", *options: str) -> int:
    file = folder / "campaign.toml"
    file.write_text(text)
    return main(["sweep", str(file), "--out", str(folder / out), "--workers", "1", "--quiet", *options])


def test_the_least_error_is_at_the_values_that_made_the_record(folder: Path) -> None:
    assert sweep(folder, CAMPAIGN) == 0
    least = json.loads((folder / "out" / "summary.json").read_text())["least"]
    assert (least["stiffness"], least["damping"]) == (9000.0, 4.0)
    assert least["nrmse"] < 1e-6
    table = ds.dataset(folder / "out" / "parts", format="parquet").to_table()
    assert table.num_rows == 21 * 9
    assert table.schema.field("rms_error").metadata == {b"unit": b"mm"}
    assert np.median(table.column("nrmse").to_numpy()) > 0.05
    assert (folder / "out" / "campaign.png").stat().st_size > 5000


def test_a_record_that_changed_is_another_campaign(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sweep(folder, CAMPAIGN, "out", "--no-plot") == 0
    lines = (folder / "r.csv").read_text().splitlines()
    lines[5] = "0.5," + lines[5].partition(",")[2]
    (folder / "r.csv").write_text("\n".join(lines))
    assert sweep(folder, CAMPAIGN, "out", "--no-plot") == 2
    assert "another campaign" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"nrmse"]', '"period"]', 'unknown value "period"; known: nrmse, rms_error'),
        ("[records]", '[drive]\nfrequency = "9 Hz"\n[records]', 'key "drive": records bring their own'),
        ("[picture]", '[factors.frequency]\nvalues = ["1 Hz"]\n[picture]', 'unknown factor "frequency"'),
        ('dataset = "dataset.toml"', 'dataset = "other.toml"', "other.toml: no such file"),
        ('dataset = "dataset.toml"', 'dataset = "dataset.toml"\nuse = "test"', 'has no records for "test"'),
    ],
)
def test_bad_input(old: str, new: str, words: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert old in CAMPAIGN
    assert sweep(folder, CAMPAIGN.replace(old, new)) == 2
    assert words in capsys.readouterr().err
