"""An oscillator's data are acquired through a driver, and its own model leaves no more than the sensor's noise."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from plant_sim.catalogue import bundled_plant
from rtctl.cli import main
from rtctl.measured import read_dataset


@pytest.mark.slow
def test_the_bundled_acquisition_is_explained_by_the_devices_own_model(tmp_path: Path) -> None:
    assert main(["acquire", "acquire_oscillator", "--out", str(tmp_path / "data"), "--quiet"]) == 0
    dataset = read_dataset(tmp_path / "data" / "dataset.toml")
    assert (dataset.plant, dataset.identity) == ("oscillator", "BEAM-RM5C")
    assert (dict(dataset.units), dict(dataset.holds)) == (
        {"drive": "m/s^2", "displacement": "mm"}, {"drive": "zero"},
    )  # fmt: skip
    assert [record.use for record in dataset.records] == ["fit", "fit", "test"]
    model, out = bundled_plant("beam_rm5c"), tmp_path / "simulated"
    data = tmp_path / "data" / "dataset.toml"
    assert main(["simulate", str(model), str(data), "--out", str(out), "--quiet", "--no-plot"]) == 0
    rows = json.loads((out / "summary.json").read_text())["records"]
    errors = [row["outputs"]["displacement"]["rms_error"] for row in rows]
    assert errors == pytest.approx([5e-3] * 3, rel=0.4)  # 5 um; the first sample's noise is in the start


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("scenario.displacement_unit=um", ["beam_rm5c", "displacement in mm", "the scenario in um"]),
        ("scenario.drive_unit=V", ["limits", '"m/s^2" is not compatible with V']),
        ("scenario.drive_unit=blorps", ["scenario.drive_unit", 'unknown unit "blorps"']),
        ("excitation.0.frequency_high=700 Hz", ["half the sample rate, 500 Hz"]),
        ("excitation.0.frequency_high=3 Hz", ["must be below frequency_high"]),
        ("driver.device=vo2_a", ['is a "vo2"', '"oscillator"']),
    ],
)
def test_what_does_not_fit_is_told(
    override: str, words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["acquire", "acquire_oscillator", "--out", str(tmp_path / "data"), "--set", override]
    assert main([*arguments, "--quiet"]) == 2
    message = capsys.readouterr().err
    assert [word for word in words if word not in message] == []


@pytest.mark.slow
def test_a_record_may_be_sampled_at_a_period_of_its_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The device's own model explains it as it does the others: the device was stepped at that period."""
    own, data = ["--set", 'excitation.1.period="4 ms"'], tmp_path / "data" / "dataset.toml"
    assert main(["acquire", "acquire_oscillator", "--out", str(data.parent), "--quiet", *own]) == 0
    records = read_dataset(data).records
    assert [record.period_s for record in records] == pytest.approx([1e-3, 4e-3, 1e-3])
    out = tmp_path / "simulated"
    model = str(bundled_plant("beam_rm5c"))
    assert main(["simulate", model, str(data), "--out", str(out), "--quiet", "--no-plot"]) == 0
    rows = json.loads((out / "summary.json").read_text())["records"]
    errors = [row["outputs"]["displacement"]["rms_error"] for row in rows]
    assert errors == pytest.approx([5e-3] * 3, rel=0.4)

    bad = ["--set", 'excitation.1.period="2.5 us"']
    assert main(["acquire", "acquire_oscillator", "--out", str(tmp_path / "no"), "--quiet", *bad]) == 2
    assert "period = 2.5 us must be whole microseconds" in capsys.readouterr().err
