"""A density integrates to the mean square, whatever the record: its ends count as much as its middle."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.border.arrays import FloatArray
from rtctl.plots.frequency.density import amplitude_density

PERIOD_S = 1e-3


def transient(late: bool) -> FloatArray:
    """A decaying oscillation of 18 Hz, at one end of a record of 13 s, on a little noise."""
    time_s = PERIOD_S * np.arange(13_320)
    decay = np.exp(-time_s / 0.2) * np.sin(2.0 * np.pi * 18.0 * time_s)
    noise = 0.01 * np.random.default_rng(1).standard_normal(len(time_s))
    made: FloatArray = (decay[::-1] if late else decay) + noise
    return made


@pytest.mark.parametrize("late", [False, True], ids=["start", "end"])
def test_a_transient_at_an_end_of_a_record_has_its_share_of_the_power(late: bool) -> None:
    values = transient(late)
    frequency, amplitude = amplitude_density(values, PERIOD_S, remove_mean=False)
    power = amplitude**2 * frequency[1]
    assert power.sum() == pytest.approx(np.mean(values**2), rel=1e-9)
    spectrum = np.abs(np.fft.rfft(values)) ** 2
    below = np.fft.rfftfreq(len(values), PERIOD_S) < 25.0
    share = float(spectrum[below].sum() / spectrum.sum())
    assert power[frequency < 25.0].sum() / power.sum() == pytest.approx(share, abs=0.02)


@pytest.mark.parametrize("count", [2, 9, 16, 100, 4001])
def test_a_record_of_any_length_has_a_density(count: int) -> None:
    values = np.random.default_rng(count).standard_normal(count)
    frequency, amplitude = amplitude_density(values, PERIOD_S, remove_mean=False)
    assert frequency[-1] == pytest.approx(0.5 / PERIOD_S)
    assert np.all(np.isfinite(amplitude))
    used = values[: count - count % (2 * max(1, round(1.0 / (frequency[1] * PERIOD_S)) // 8))]
    assert np.sum(amplitude**2) * frequency[1] == pytest.approx(np.mean(used**2), rel=1e-9)


def test_a_line_has_its_rms_and_leaks_little() -> None:
    time_s = PERIOD_S * np.arange(9000)
    frequency, amplitude = amplitude_density(3.0 * np.sin(2.0 * np.pi * 50.3 * time_s + 0.4), PERIOD_S)
    power = amplitude**2 * (frequency[1] - frequency[0])
    assert power[abs(frequency - 50.3) < 4.0].sum() == pytest.approx(4.5, rel=1e-3)
    assert amplitude[frequency > 200.0].max() < 1e-6 * amplitude.max()
