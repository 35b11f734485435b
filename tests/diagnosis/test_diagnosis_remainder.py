"""What named causes leave is told by its size, in the reading's unit and its share, and by whether it matters."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.diagnosis.report.words.noise import Noise
from rtctl.diagnosis.report.words.remainder import RecordsError, Remainder


def test_a_residual_next_to_the_noise_is_told_as_small() -> None:
    """1.01 times the noise of 11.6 um, of a motion of 8 mm RMS: sqrt(1.01^2 - 1) * 11.6 um = 1.64 um."""
    said = Remainder.of(1.01, "displacement", "mm", Noise(0.0116, 0.0116), 8.0).in_words
    assert said.startswith(
        "What is left beside the noise on the fitted records is 1.64 um (RMS), 0.021 % of the displacement itself: "
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
    assert said.startswith(
        "What is left on the fitted records is 111 um (RMS), 26 % of the displacement itself. Only 1.8 um of it"
    )
    assert "may be slow noise or what the model lacks" in said


# (residual over noise, noise, RMS error on test records) of benches of others, in um, and what is said of predictions
BENCHES = {
    "a gap": (1.097, 18.05, 63.26, "is 60.6 um (RMS)", "3.4 times the noise, so predictions are off by more"),
    "an axis": (
        1.487,
        0.07265,
        4.491,
        "is 4.49 um (RMS)",
        "62 times the noise, so predictions are off by more",
    ),
    "a piezo": (41.0, 8.887e-3, 1.668, "is 1.67 um (RMS)", "1.9e+02 times the noise, so it matters"),
    "a comb": (
        1.02,
        3.267e-3,
        5.388e-3,
        "is 4.28 nm (RMS)",
        "about the size of the noise (1.3 times the noise)",
    ),
}


@pytest.mark.parametrize("bench", BENCHES)
def test_predictions_are_judged_by_the_test_records_where_these_show_more(bench: str) -> None:
    """A fit to parts of 0.45 times the noise is no prediction beside a free run of 3.5 times the noise."""
    over, noise, error, size, judgement = BENCHES[bench]
    tests = RecordsError(error, noise)
    said = Remainder.of(over, "displacement", "um", Noise(noise, noise), 2000.0, tests).in_words
    assert said.startswith(f"What is left beside the noise on the test records {size}")
    assert judgement in said
    assert "nothing to worry" not in said
    assert f"On the fitted records it is {np.sqrt(over**2 - 1.0):.2g} times the noise" in said


def test_test_records_that_show_less_leave_the_judgement_to_the_fitted_ones() -> None:
    said = Remainder.of(4.0, "velocity", "mm/s", Noise(1.5, 1.0), 500.0, RecordsError(1.6, 1.5)).in_words
    assert "on the fitted records is 5.81 mm/s" in said
    assert "test records" not in said


def test_a_noise_that_may_hold_misfit_is_told_beside_the_larger_error() -> None:
    said = Remainder.of(
        1.12, "displacement", "um", Noise(99.0, 1.8), 424.0, RecordsError(180.0, 99.0)
    ).in_words
    assert said.startswith(
        "What is left on the test records is 180 um (RMS), 42 % of the displacement itself."
    )


def test_an_error_far_beyond_the_whole_noise_is_not_called_slow_noise() -> None:
    """An axis with an error of 120 um on its test records, and a noise of 1.3 um of which 39 nm are certain."""
    said = Remainder.of(
        5.41, "displacement", "um", Noise(1.292, 0.039), 128e3, RecordsError(120.3, 1.292)
    ).in_words
    assert "93 times the noise" in said
    assert "slow noise" not in said


def test_free_runs_that_diverge_are_no_prediction() -> None:
    tests = RecordsError(float("inf"), 1.5)
    said = Remainder.of(1.01, "velocity", "mm/s", Noise(1.5, 1.0), 500.0, tests).in_words
    assert "free runs over the test records diverge" in said
    assert "nothing to worry" not in said
