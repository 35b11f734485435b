"""A sign, a factor, an offset that the re-fit found is said; what a file's values may be off by is not."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest
from diagnosis_cases import FRICTION, answer_to, device, json_of, measured, noise_drive, write_case


@pytest.mark.parametrize(("factor", "said"), [(-1.0, True), (3.0, True), (1.2, False)])
def test_a_drive_gain_of_another_sign_or_size_is_said(tmp_path: Path, factor: float, said: bool) -> None:
    plant = device(drive_gain=(430.0 * factor, "mm/s^2/V"))
    records = [(noise_drive(k), measured(plant, noise_drive(k)), use) for k, use in ((1, "fit"), (2, "test"))]
    found = answer_to(tmp_path, records)
    moved = [warning for warning in found["warnings"] if "the re-fit changed" in warning]
    assert bool(moved) == said
    if said:
        assert "drive_gain from 430" in moved[0]
        assert f"{430.0 * factor:.0f}"[:2] in moved[0]


def test_a_value_that_stays_within_the_interval_of_its_file_is_not_said(tmp_path: Path) -> None:
    plant = device(drive_gain=(1290.0, "mm/s^2/V"))
    records = [(noise_drive(k), measured(plant, noise_drive(k)), use) for k, use in ((1, "fit"), (2, "test"))]
    manifest, model = write_case(tmp_path, records), tmp_path / "model.toml"
    text = model.read_text().replace('{ value = 430.0, unit = "mm/s^2/V" }',
                                     '{ value = 430.0, low = -700.0, high = 1560.0, unit = "mm/s^2/V" }')  # fmt: skip
    assert "low = -700.0" in text
    model.write_text(text)
    found = json_of(manifest, model, "friction.coulomb")
    assert not any("the re-fit changed" in warning for warning in found["warnings"])


def test_a_value_that_the_named_cause_brings_back_is_not_said(tmp_path: Path) -> None:
    plant = device(
        FRICTION
    )  # beside which the damping of the nominal re-fit is more than twice that of the file
    records = [(drive, measured(plant, drive), use)
               for k, use in ((1, "fit"), (2, "test")) for drive in [noise_drive(k, level=3.0)]]  # fmt: skip
    found = answer_to(tmp_path, records)
    assert [cause["id"] for cause in found["causes"]] == ["friction.coulomb"]
    assert not any("the re-fit changed" in warning for warning in found["warnings"])


def test_a_value_that_was_identified_from_the_same_dataset_is_not_said(tmp_path: Path) -> None:
    plant = device(drive_gain=(1290.0, "mm/s^2/V"))
    records = [(noise_drive(k), measured(plant, noise_drive(k)), use) for k, use in ((1, "fit"), (2, "test"))]
    manifest, model = write_case(tmp_path, records), tmp_path / "model.toml"
    for content, said in ((manifest.read_bytes(), False), (b"another one", True)):
        digest = hashlib.sha256(content).hexdigest()
        own = tmp_path / f"{said}.toml"
        own.write_text(f'{model.read_text()}\n[provenance.sha256]\n"{manifest.name}" = "{digest}"\n')
        found = json_of(manifest, own, "friction.coulomb")
        assert any("the re-fit changed" in warning for warning in found["warnings"]) == said
