"""Steady states of a staircase: what is settled is averaged, what still settles is not."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from rtctl.identification.vo2.staircase import (
    count_settled_samples,
    estimate_unsettled_share,
    extract_steady_states,
    find_hold_ends,
    simulate_hold_ends,
)
from rtctl.measured.dataset import Record

HOLD, HOLDS = 20, 200
LEVELS = np.random.default_rng(1).uniform(4.0, 8.0, HOLDS)


def record(noise, *, colour=0.0, settle=0.0, seed=2, deflection=True):
    """Holds of twenty samples; readings linear in the current, noise of an RMS and a colour, `settle` samples' lag."""
    draw = np.random.default_rng(seed)
    current = np.repeat(LEVELS, HOLD)
    late = current.copy()
    for k in range(1, len(late)):
        late[k] = current[k] + (late[k - 1] - current[k]) * (np.exp(-1.0 / settle) if settle else 0.0)
    signals = {"current": current}
    for name, gain in (("resistance", -1000.0), ("deflection", 5.0)):
        white = draw.normal(size=len(current) + 500)
        coloured = np.zeros_like(white)
        for k in range(1, len(white)):
            coloured[k] = colour * coloured[k - 1] + np.sqrt(1.0 - colour**2) * white[k]
        signals[name] = gain * (late - 12.0 * (gain < 0)) + abs(gain) * noise * coloured[500:]
    if not deflection:
        del signals["deflection"]
    return Record(name="r", file="r.csv", use="identify", period_s=1e-3, signals=signals)


def errors(one):
    """Of the steady deflections, in current."""

    @dataclasses.dataclass
    class Dataset:
        records: tuple[Record, ...]
        path: str = "dataset.toml"

    ends = extract_steady_states(Dataset((one,)))
    return ends.deflection_um[ends.scored] / 5.0 - LEVELS


@pytest.mark.parametrize("colour", [0.0, 0.8])
def test_where_all_is_settled_half_of_each_hold_is_averaged(colour):
    one = record(0.01, colour=colour)
    assert count_settled_samples(one) == HOLD // 2
    assert errors(one).std() < (0.35 if colour == 0.0 else 0.8) * 0.01


def test_what_still_settles_is_not_averaged():
    assert (
        count_settled_samples(record(1e-4, settle=5.0))
        < count_settled_samples(record(0.02, settle=1.0))
        == HOLD // 2
    )
    slow = record(1e-6, settle=5.0)
    assert count_settled_samples(slow) == 1
    ends = find_hold_ends(slow.signals["current"])
    np.testing.assert_array_equal(errors(slow), slow.signals["deflection"][ends] / 5.0 - LEVELS)


def test_readings_without_noise_are_taken_at_the_ends():
    exact = record(0.0, settle=0.5)
    assert count_settled_samples(exact) <= 4
    assert np.abs(errors(exact)).max() < 1e-6


def test_a_few_holds_do_not_say_whether_they_settled():
    one = record(0.01)
    few = {name: values[: 3 * HOLD] for name, values in one.signals.items()}
    assert count_settled_samples(dataclasses.replace(one, signals=few)) == 1


def test_a_record_without_deflection_is_settled_by_its_resistance():
    assert count_settled_samples(record(0.01, deflection=False)) == HOLD // 2


def test_the_surrogate_is_averaged_over_the_same_samples():
    @dataclasses.dataclass
    class Dataset:
        records: tuple[Record, ...]

    one = record(0.02)
    one.signals["current"][:] = np.repeat(np.tile([4.0, 8.0], HOLDS // 2), HOLD)
    v = simulate_hold_ends(Dataset((one,)), 2e-3)[1:]
    left = np.exp(-np.arange(HOLD) / 2.0)  # of a step's square, at each sample of a hold
    squares = 64.0 - 48.0 * left[HOLD - count_settled_samples(one) :]
    assert v[3] == pytest.approx(np.sqrt(squares).mean(), rel=1e-4)


@pytest.mark.parametrize("noise", [1e-4, 0.3])
def test_what_the_last_sample_of_a_hold_still_brings_is_known_whatever_the_noise(noise):
    settle = 6.0
    expected = np.exp(-(HOLD - 2) / settle) * (1.0 - np.exp(-1.0 / settle))
    assert estimate_unsettled_share(record(noise, settle=settle)) == pytest.approx(
        expected, abs=0.15 * expected + 0.05 * noise
    )
    assert abs(estimate_unsettled_share(record(noise))) < 0.05 * noise


def test_where_there_are_few_holds_nothing_is_said_of_what_still_moves():
    one = record(0.01)
    few = dataclasses.replace(one, signals={name: values[: 5 * HOLD] for name, values in one.signals.items()})
    assert np.isnan(estimate_unsettled_share(few))
