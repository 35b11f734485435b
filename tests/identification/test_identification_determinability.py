"""What data cannot determine is said, and what they can is not doubted."""

from __future__ import annotations

import numpy as np
import pytest
from oscillator_cases import DUFFING, free_values, multisine, oscillator, record_of, tone

from rtctl.identification.fit import Fit
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.least_squares.determinability import assess_determinability
from rtctl.identification.simulation_error.output_error import FitOptions, fit_output_error

RATE_HZ = 1000.0


def fitted(record: FitRecord) -> Fit:
    simulation = oscillator(DUFFING)
    return fit_output_error(
        simulation, [record], FitOptions(threads=1), starts=[1.02 * free_values(simulation)]
    )


def test_one_steady_tone_cannot_tell_damping_from_gain() -> None:
    record = record_of(oscillator(DUFFING), tone(14.0, 2.0, RATE_HZ, 20.0), RATE_HZ, 0.01, seed=1)
    fit = fitted(record.cut(10_000, 20_000))
    assert {"damping", "drive_gain"} <= set(fit.determinability.undetermined)
    said = " ".join(fit.determinability.describe())
    assert "cannot tell damping" in said
    assert "damping/drive_gain to 0.0" in said  # their ratio is known to parts of a per mille
    ratio = fit.values[0] / fit.values[3]
    assert ratio == pytest.approx(DUFFING["damping"] / DUFFING["drive_gain"], rel=5e-3)


@pytest.mark.parametrize("kind", ["from rest", "ring-down", "multisine"])
def test_a_start_from_rest_a_ring_down_or_a_multisine_determine_all(kind: str) -> None:
    drive = tone(14.0, 2.0, RATE_HZ, 8.0)
    if kind == "ring-down":
        drive[3000:] = 0.0
    if kind == "multisine":
        drive = multisine(5.0, 30.0, 2.0, RATE_HZ, 8.0, seed=2)
    fit = fitted(record_of(oscillator(DUFFING), drive, RATE_HZ, 0.01, seed=2))
    truth = np.array(list(DUFFING.values()))
    assert fit.determinability.describe() == ()
    assert (fit.standard_errors < 0.01 * truth).all()
    assert (np.abs(fit.values - truth) < 4.0 * fit.standard_errors).all()


def test_a_drive_that_is_never_on_says_nothing_of_its_gain() -> None:
    record = record_of(oscillator(DUFFING), np.zeros(4000), RATE_HZ, 0.01, seed=3, initial=(3.0, 0.0))
    fit = fitted(record)
    assert fit.determinability.insensitive == ("drive_gain",)
    assert fit.standard_errors[3] == np.inf
    assert np.isfinite(fit.standard_errors[:3]).all()


def test_a_small_cubic_is_not_significant_which_is_not_undetermined() -> None:
    simulation = oscillator({**DUFFING, "stiffness_cubic": 0.0})
    record = record_of(simulation, multisine(5.0, 30.0, 2.0, RATE_HZ, 8.0, seed=4), RATE_HZ, 0.01, seed=4)
    fit = fitted(record)
    assert fit.determinability.insignificant == ("stiffness_cubic",)
    assert fit.determinability.undetermined == ()


def test_a_product_is_named_where_two_only_act_as_one() -> None:
    # only x + y (in logarithms) is known: the sum of the first two to 0.1 %, their difference to 50 %
    fixed, loose = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0), np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0)
    third = np.array([0.0, 0.0, 1.0])
    covariance = 1e-6 * np.outer(fixed, fixed) + 0.25 * np.outer(loose, loose) + 1e-6 * np.outer(third, third)
    found = assess_determinability(
        ("a", "b", "c"), np.array([1.0, 1.0, 1.0]), np.linalg.inv(covariance), covariance, np.ones(3)
    )
    assert found.confounded[0].names == ("a", "b")
    assert "a x b to 0.1 %" in found.confounded[0].fixed
