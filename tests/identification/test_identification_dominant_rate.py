"""The frequency of a motion, from which an accelerometer's reading is integrated and fits start."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from rtctl.border.simulation import Stimulus
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import find_dominant_rate

FloatArray = NDArray[np.float64]
PERIOD_S = 1.0 / 2560.0
RATE = 2.0 * np.pi * 81.0


def accelerometer(drift: float, rate: float = RATE) -> FitRecord:
    """4 s of a resonance of Q = 20 under white noise, and a drift of so many times its RMS that settles."""
    drive = np.random.default_rng(5).standard_normal(10240)
    turn = np.exp(complex(-0.025, 1.0) * rate * PERIOD_S)
    motion = lfilter([1.0], [1.0, -2.0 * turn.real, abs(turn) ** 2], drive)
    reading = np.gradient(np.gradient(motion, PERIOD_S), PERIOD_S)
    reading += drift * reading.std() * np.sqrt(np.arange(len(drive)) / len(drive))
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
    return FitRecord(name="a", stimulus=stimulus, measured={"acceleration": reading})


@pytest.mark.parametrize("drift", [0.0, 0.15, -2.0])
def test_a_drift_of_an_accelerometer_is_not_its_motion(drift: float) -> None:
    assert find_dominant_rate([accelerometer(drift)]) == pytest.approx(RATE, rel=0.1)


def test_a_motion_of_few_periods_stays_what_it_is() -> None:
    slow = 2.0 * np.pi * 1.5
    assert find_dominant_rate([accelerometer(0.0, slow)]) == pytest.approx(slow, rel=0.5)
