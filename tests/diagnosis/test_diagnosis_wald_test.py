"""A value of the model's file that is off is named; values that are all somewhat off were a start and claim nothing."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import NOMINAL, device, measured, noise_drive, write_case

from rtctl.cli import main
from rtctl.diagnosis.verification.wald_test import wald_statistic


def case(folder: Path, **factors: float) -> Path:
    """Two fit records and a test record of the nominal device; the model's values times `factors`."""
    plant = device()
    drives = [noise_drive(1), noise_drive(2, 4.0), noise_drive(3, 7.0)]
    uses = ("fit", "fit", "test")
    manifest = write_case(folder, [(d, measured(plant, d), use) for d, use in zip(drives, uses, strict=True)])
    text = '[model]\nkind = "oscillator"\n[model.parameters]\n'
    for name, (value, unit) in NOMINAL.items():
        text += f'{name} = {{ value = {value * factors.get(name, 1.0)!r}, unit = "{unit}" }}\n'
    (folder / "model.toml").write_text(text)
    return manifest


def answer(manifest: Path) -> dict[str, object]:
    folder = manifest.parent
    assert (
        main(["diagnose", str(manifest), "--model", str(folder / "model.toml"), "--out", str(folder / "d")])
        == 0
    )
    content: dict[str, object] = json.loads((folder / "d" / "diagnosis.json").read_text())
    return content


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("damping", marks=pytest.mark.slow),
        "stiffness",
        pytest.param("drive_gain", marks=pytest.mark.slow),
    ],
)
def test_one_value_that_is_off_is_named_and_mended(tmp_path: Path, name: str) -> None:
    found = answer(case(tmp_path, **{name: 1.2}))
    assert found["verdict"] == "explained"
    (cause,) = found["causes"]  # type: ignore[misc]
    assert (cause["id"], cause["kind"], cause["indistinguishable_from"]) == (
        f"parameter.{name}",
        "parameter",
        [],
    )
    true = NOMINAL[name][0]
    estimate = cause["parameters"][name]
    assert estimate["low"] < true < estimate["high"]
    assert found["gain"]["ratio_low"] > 1.0  # type: ignore[index]
    extended = tomllib.loads((tmp_path / "d" / "model-extended.toml").read_text())["model"]["parameters"]
    assert extended[name]["value"] == pytest.approx(true, rel=0.05)
    untouched = {other: extended[other]["value"] for other in NOMINAL if other != name}
    assert untouched == {other: NOMINAL[other][0] for other in NOMINAL if other != name}
    page = (tmp_path / "d" / "report.html").read_text()
    assert "with one value mended" in page


@pytest.mark.slow
def test_values_that_are_all_off_are_a_start_and_no_claim(tmp_path: Path) -> None:
    found = answer(case(tmp_path, damping=1.1, stiffness=0.98, drive_gain=1.07))
    assert (found["verdict"], found["causes"]) == ("adequate", [])


@pytest.mark.slow
def test_a_value_within_the_interval_of_its_file_is_not_off(tmp_path: Path) -> None:
    manifest = case(tmp_path, drive_gain=1.05)
    path = tmp_path / "model.toml"
    gain = NOMINAL["drive_gain"][0]
    path.write_text(path.read_text().replace(
        'unit = "mm/s^2/V"', f'unit = "mm/s^2/V", low = {gain * 0.95}, high = {gain * 1.15}'
    ))  # fmt: skip
    assert answer(manifest)["verdict"] == "adequate"


def test_walds_statistic_is_that_of_white_numbers_after_any_mixing() -> None:
    rng = np.random.default_rng(0)
    mixing, white = rng.standard_normal((4, 4)) * [1.0, 1e3, 1e-4, 1.0], rng.standard_normal(4)
    mixing = mixing.T
    assert wald_statistic(mixing @ white, mixing @ mixing.T) == pytest.approx(white @ white, rel=1e-6)
