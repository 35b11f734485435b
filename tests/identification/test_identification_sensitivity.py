"""Slopes of a free run are right where a motion hangs on the last digits of a parameter, and at a bound."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from oscillator_cases import HM, oscillator, record_of, tone

from rtctl.border.simulation import Prediction, Stimulus
from rtctl.identification.simulation_error.sensitivity import Sensitivity

FloatArray = NDArray[np.float64]
RATE_HZ, SECONDS = 500.0, 2.0
SHAKEN = tone(8.0, 5.0, RATE_HZ, SECONDS)
"""m/s^2: crosses the beam's barrier so slowly that 1e-7 of a parameter is a quarter of the motion at the end."""


def slopes_of(values: dict[str, float]) -> tuple[FloatArray, FloatArray]:
    """(4, n) by `Sensitivity`, and the same over steps of 1e-10 to both sides that the test takes itself."""
    simulation = oscillator(values)
    record = record_of(simulation, SHAKEN, RATE_HZ, 0.0, seed=0)
    sensitivity = Sensitivity.of(simulation, [record])
    at = sensitivity.current_values / sensitivity.scale
    found = sensitivity.linearise(record, at, np.zeros(2))
    assert found is not None
    steps = 1e-10 * sensitivity.scale * np.maximum(np.abs(at), 1.0)
    lanes = sensitivity.current_values + np.vstack((np.diag(steps), -np.diag(steps)))
    runs = simulation.predict(record.stimulus, lanes, np.zeros((8, 2))).outputs["displacement"]
    return found.shared[:, 0], (runs[:4] - runs[4:]) / (2.0 * steps / sensitivity.scale)[:, None]


def relative_errors(found: FloatArray, expected: FloatArray) -> FloatArray:
    errors: FloatArray = np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1)
    return errors


def test_slopes_hold_where_a_motion_hangs_on_the_last_digits_of_a_parameter() -> None:
    found, expected = slopes_of(HM)
    assert np.abs(expected).max() > 1e7  # by steps of 1e-7 on one side they are wrong by a quarter
    assert (relative_errors(found, expected) < 2e-4).all(), relative_errors(found, expected)


def test_no_neighbour_lies_beyond_a_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    simulation = oscillator(HM | {"damping": 0.0})
    seen, predict = [], type(simulation).predict

    def watched(self: object, stimulus: Stimulus, values: FloatArray, *rest: object) -> Prediction:
        seen.append(values)
        return predict(self, stimulus, values, *rest)

    record = record_of(simulation, SHAKEN, RATE_HZ, 0.0, seed=0)
    sensitivity = Sensitivity.of(simulation, [record])
    monkeypatch.setattr(type(simulation), "predict", watched)
    assert (
        sensitivity.linearise(record, sensitivity.current_values / sensitivity.scale, np.zeros(2)) is not None
    )
    free_run_ahead_and_behind = 1 + 6 + 5  # behind, the damping would be below 0
    assert [len(values) for values in seen] == [1 + 6, free_run_ahead_and_behind]
    assert min(values[:, 0].min() for values in seen) == 0.0
