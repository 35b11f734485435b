"""What the tests of the later styles and of those that are kept back check alike."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from foreign_common import Array
from foreign_device import EFFECTS, Effect, Readings
from foreign_grain_sizes import both
from foreign_oscillator_device import Device, Record
from foreign_oscillator_motion import Law

NATURAL = 2.0 * np.pi * 5.0  # rad/s
DEVICE = Device(
    law=Law(damping=NATURAL / 20.0, stiffness=NATURAL**2, cubic=0.0, gain=300.0), period_s=0.01, hold="linear"
)
WAVE = np.convolve(np.random.default_rng(5).normal(size=300), np.ones(5) / 2.0, "same")
RECORD = Record(name="r", use="fit", drive=WAVE - WAVE[0])
BESIDE = {"actuation.deadband": {"form": "zero"}}


def check_delay_and_tcr(simulate: Callable[..., Readings], device: Any) -> None:
    """A delay of whole samples shifts; a heater with TCR settles at its fixed point.

    `device`: 20 °C, 1 K/mA^2, 1 ms, read at the ends, and nothing turns in it.
    """
    current = np.repeat(np.arange(3.0, 9.0), 20)
    late = simulate(device, current, (Effect(id="actuation.delay", size=2e-3, unit="s"),)).temperature
    shifted = simulate(device, np.concatenate([[0.0, 0.0], current[:-2]])).temperature
    np.testing.assert_allclose(late, shifted, rtol=1e-12)
    hot = simulate(device, np.full(300, 6.0), (Effect(id="heater.tcr", size=2e-3, unit="1/K"),))
    assert hot.temperature[-1] == pytest.approx(20.0 + 36.0 / (1.0 - 2e-3 * 36.0), rel=1e-9)


def check_null_and_middling(
    simulate: Callable[..., Readings],
    device: Any,
    current: Array,
    null: Readings,
    guessed: tuple[Effect, float, float],
) -> None:
    """A guessed effect is in its range, vanishes at size zero and acts otherwise; `null`: readings without it."""
    guess, low, high = guessed
    assert low <= guess.size <= high
    guess = replace(guess, values=guess.values | BESIDE.get(guess.id, {}))
    zero = simulate(device, current, (replace(guess, size=0.0),))
    some = simulate(device, current, (guess,))
    for before, none, after in zip(null, zero, some, strict=True):
        np.testing.assert_array_equal(none, before)
        assert np.isfinite(after).all()
    assert change(some, null) > 1e-3


def change(some: Readings, null: Readings) -> float:
    """The larger of the changes of ln(resistance) and deflection, RMS over standard deviation."""
    moved, spread = both([some]) - both([null]), np.std(both([null]), axis=0)
    return float(np.max(np.sqrt(np.mean(moved**2, axis=0)) / spread))


def check_turns(drawn: list[tuple[int, list[str]]]) -> None:
    """Of 78 seeds, one in six is null, one has two, and single effects go round."""
    counts = [count for count, _ in drawn]
    assert (counts.count(0), counts.count(1), counts.count(2)) == (13, 52, 13)
    assert all(counts[k : k + 6].count(0) == 1 for k in range(0, 78, 6))
    first = [tried[0] for count, tried in drawn if count == 1]
    assert {first.count(name) for name in EFFECTS} == {4}
