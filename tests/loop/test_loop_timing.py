"""Histograms hold quantiles to a hundredth in constant memory; missed periods end a run where they were told to."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loop_cases import FIRST, SAFE, ScriptedDriver, parts_of

from rtctl.border.errors import DriverError, Fault
from rtctl.evaluation.metrics import write_json
from rtctl.loop.supervisor import run_loop
from rtctl.timing.clock import MOST_BEHIND, Missed, MonotonicClock, Tick, TrackedSpin
from rtctl.timing.histogram import BUCKETS, Histogram, bounds_ns
from rtctl.timing.realtime import RealTime, real_time
from rtctl.timing.step_timing import GRACE_STEPS, StepTiming

PERIOD_NS = 1_000_000


def histogram_of(values: list[int]) -> Histogram:
    histogram = Histogram()
    for value in values:
        histogram.record(value)
    return histogram


def test_buckets_cover_every_duration_once_and_are_narrow() -> None:
    bounds = [bounds_ns(bucket) for bucket in range(BUCKETS)]
    assert bounds[0] == (0, 0)
    assert all(low == before + 1 for (_, before), (low, _) in zip(bounds, bounds[1:], strict=False))
    assert all(high - low <= low / 64 for low, high in bounds)
    assert bounds[-1][1] >= 18 * 60 * 1e9


@settings(deadline=None)  # the first example compiles
@given(st.lists(st.integers(0, 10**12), min_size=1, max_size=300), st.sampled_from([0.5, 0.9, 0.99, 0.999]))
def test_a_quantile_is_that_of_numpy_to_a_hundredth(values: list[int], share: float) -> None:
    exact = float(np.quantile(values, share, method="inverted_cdf"))
    assert histogram_of(values).quantile_ns(share) == pytest.approx(exact, rel=1 / 100, abs=0.5)


@settings(deadline=None)  # the first example compiles
@given(st.lists(st.integers(-5, 2**50), min_size=1, max_size=100))
def test_nothing_is_lost(values: list[int]) -> None:
    histogram = histogram_of(values)
    assert histogram.count == len(values) == sum(bucket.durations for bucket in histogram.buckets())
    assert histogram.largest_ns == max(0, *values)
    assert sum(histogram.decades_us()["count"]) == len(values)


def test_counts_stand_between_ones_twos_and_fives() -> None:
    found = histogram_of([1500, 1500, 4000, 90_000]).decades_us()
    assert found == {"at_most": [2.0, 5.0, 10.0, 20.0, 50.0, 100.0], "count": [2, 1, 0, 0, 0, 1]}


def test_nothing_timed_is_null_in_the_summary(tmp_path: Path) -> None:
    write_json(tmp_path / "s.json", Histogram().summary_us(), "run")
    written = json.loads((tmp_path / "s.json").read_text())
    assert written | {"program": ""} == {"program": "", "p50": None, "p99": None, "p99_9": None, "max": None}


def test_the_timing_summary_has_the_contract_s_fields() -> None:
    timing = StepTiming()
    for k in range(11):
        timing.step(1000 * k, 2000 * k, 3000 * k)
    timing.missed(2)
    summary = timing.summary(1e-3)
    assert {key: summary[key] for key in ("period_s", "steps", "overruns")} == {
        "period_s": 1e-3,
        "steps": 11,
        "overruns": 2,
    }
    largest = [summary[key]["max"] for key in ("lateness_us", "round_trip_us", "compute_us")]
    assert largest == pytest.approx([10.0, 20.0, 30.0])
    assert summary["lateness_us"]["p50"] == pytest.approx(5.0, rel=0.01)


class LateClock:
    """Misses `each` periods before every step."""

    def __init__(self, each: int) -> None:
        self._each = each
        self._step = 0

    def start(self, period_s: float) -> None:
        self._step = 0

    def wait(self) -> Tick:
        self._step += 1
        return Tick((self._each + 1) * (self._step - 1), 0.0)


def test_too_many_missed_periods_end_the_run_at_the_safe_level() -> None:
    driver = ScriptedDriver()
    parts, plan, _ = parts_of(driver, clock=LateClock(1), samples=200, settle=0)
    parts.timing.__init__(stop_after=5)  # type: ignore[misc]
    outcome = run_loop(parts, plan, FIRST)
    assert outcome.fault is Fault.DEADLINES_MISSED
    assert outcome.steps == GRACE_STEPS + 4, "the fifth missed period that is judged ends it"
    assert "at most 5 are allowed" in outcome.message
    assert driver.closed_with == [(SAFE,)]
    assert len(driver.commands) == outcome.steps, "nothing is commanded after it"


def test_a_missed_period_is_forgiven_after_a_hundred_steps_in_time() -> None:
    timing = StepTiming(stop_after=2)
    for _ in range(20):
        for _ in range(100):
            timing.step(0, 0, 0)
        timing.missed(1)
    assert timing.overruns == 20
    with pytest.raises(DriverError, match="21 periods missed, 1 of them just now"):
        timing.missed(1)


class FakeTime:
    """A machine clock whose sleeps last longer than asked by what `late_ns` says."""

    def __init__(self, late_ns: list[int]) -> None:
        self.now = 1_000
        self._late_ns = iter(late_ns)

    def now_ns(self) -> int:
        self.now += 50  # a look at the clock takes time, so that a spin ends
        return self.now

    def sleep(self, duration_s: float) -> None:
        self.now += round(duration_s * 1e9) + next(self._late_ns)


def test_a_spin_that_outlasts_the_wake_ups_lateness_is_in_time() -> None:
    random = np.random.default_rng(1)
    late = (20_000 + random.exponential(5_000, 6000)).astype(int).tolist()
    time = FakeTime(late)
    clock = MonotonicClock(time.now_ns, time.sleep, spin=TrackedSpin(200_000))
    clock.start(1e-3)
    lateness_us = [1e6 * clock.wait().lateness_s for _ in range(6000)][1000:]
    assert np.quantile(lateness_us, 0.99) <= 0.1
    assert clock.spin.length_ns == pytest.approx(np.quantile(late, 0.998), rel=0.25)


def test_a_spin_is_never_longer_than_it_may_be() -> None:
    spin = TrackedSpin(100_000)
    for _ in range(500):
        spin.woke(5_000_000)
    assert spin.length_ns == 100_000
    for _ in range(100_000):
        spin.woke(0)
    assert spin.length_ns == 0.0


def test_catching_up_takes_every_step_without_sleeping_until_it_is_in_time_again() -> None:
    time = FakeTime([0] * 50)
    clock = MonotonicClock(time.now_ns, time.sleep, missed=Missed.CATCH_UP)
    clock.start(1e-3)
    clock.wait()
    time.now += 4 * PERIOD_NS + PERIOD_NS // 2
    ticks = [clock.wait() for _ in range(5)]
    assert [tick.step for tick in ticks] == [1, 2, 3, 4, 5]
    assert [tick.lateness_s for tick in ticks[:4]] == pytest.approx(
        [3.5e-3, 2.5e-3, 1.5e-3, 0.5e-3], rel=0.01
    )
    assert ticks[4].lateness_s < 1e-6


def test_what_lies_too_far_behind_is_skipped_even_then() -> None:
    time = FakeTime([0] * 50)
    clock = MonotonicClock(time.now_ns, time.sleep, missed=Missed.CATCH_UP)
    clock.start(1e-3)
    clock.wait()
    time.now += 500 * PERIOD_NS
    assert clock.wait().step == 500 - MOST_BEHIND


def test_what_the_machine_does_not_allow_is_told_and_the_rest_is_undone() -> None:
    before = sys.getswitchinterval(), os.sched_getaffinity(0)
    with real_time(RealTime(cpu=100_000)) as requests:
        found = {request.name: request for request in requests}
        assert sys.getswitchinterval() < before[0]
    assert not found["CPU 100000 only"].applied
    assert "NOT applied, " in found["CPU 100000 only"].describe()
    assert found["garbage collection frozen"].applied
    assert (sys.getswitchinterval(), os.sched_getaffinity(0)) == before
