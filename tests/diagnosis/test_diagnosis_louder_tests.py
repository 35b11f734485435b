"""Test records whose readings are noisier than the fitted ones: told as that, and never where motion is left."""

from __future__ import annotations

from pathlib import Path

from diagnosis_cases import NOISE_MM, answer_to, device, measured, noise_drive

IDS = "stiffness.cubic,friction.coulomb"
LOUDER = "their readings are noisier"


def warnings(folder: Path, noise: float, *, stiffness: float = 1.6e4) -> tuple[str, list[str]]:
    """Verdict and warnings of a right model whose test record has such noise [mm], and perhaps another device."""
    fitted = [(noise_drive(seed), measured(device(), noise_drive(seed)), "fit") for seed in (1, 2)]
    other = device(stiffness=(stiffness, "1/s^2"))
    test = (noise_drive(3), measured(other, noise_drive(3), noise), "test")
    found = answer_to(folder, [*fitted, test], IDS)
    return found["verdict"], [one for one in found["warnings"] if "on the test records" in one]


def test_louder_noise_is_no_contradiction(tmp_path: Path) -> None:
    verdict, told = warnings(tmp_path, 5.0 * NOISE_MM)
    assert verdict == "adequate"
    assert LOUDER in told[0]


def test_motion_that_is_left_is_not_called_noise(tmp_path: Path) -> None:
    _, told = warnings(tmp_path, NOISE_MM, stiffness=1.65e4)
    assert told
    assert LOUDER not in told[0]
