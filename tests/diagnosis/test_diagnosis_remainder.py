"""What named causes leave is told by its size, in the reading's unit and its share, and by whether it matters."""

from __future__ import annotations

import pytest

from rtctl.diagnosis.report.words.noise import Noise
from rtctl.diagnosis.report.words.remainder import Remainder


def test_a_residual_next_to_the_noise_is_told_as_small() -> None:
    """1.01 times the noise of 11.6 um, of a motion of 8 mm RMS: sqrt(1.01^2 - 1) * 11.6 um = 1.64 um."""
    said = Remainder.of(1.01, "displacement", "mm", Noise(0.0116, 0.0116), 8.0).in_words
    assert said.startswith(
        "What is left beside the noise is 1.64 um (RMS), 0.021 % of the displacement itself: "
    )
    assert "0.14 times the noise, so nothing to worry about" in said


@pytest.mark.parametrize(
    ("ratio", "said"),
    [
        (1.0, "nothing to worry"),
        (1.5, "about the size of the noise"),
        (4.0, "3.9 times the noise, so it matters"),
    ],
)
def test_the_judgement_follows_the_noise(ratio: float, said: str) -> None:
    assert said in Remainder.of(ratio, "velocity", "mm/s", Noise(1.5, 1.0), 500.0).in_words


def test_a_logarithm_is_told_in_percent() -> None:
    assert "is 1.7 % (RMS)" in Remainder.of(2.0, "resistance", "ln(ohm)", Noise(0.01, 0.01), 0.5).in_words


def test_a_noise_as_smooth_as_a_motion_is_not_called_noise() -> None:
    """Of 99 um of "noise" in a motion of 0.42 mm that stops limit, what came before tells all but 1.8 um."""
    said = Remainder.of(1.12, "displacement", "um", Noise(99.0, 1.8), 424.0).in_words
    assert said.startswith("What is left is 111 um (RMS), 26 % of the displacement itself. Only 1.8 um of it")
    assert "may be slow noise or what the model lacks" in said
