"""Deadlines are absolute: lateness never becomes drift, missed periods are skipped as wholes."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.timing.clock import MonotonicClock, SimulatedClock, Tick

PERIOD_NS = 1_000_000
START_NS = 123_456_789


class FakeTime:
    """A machine clock that moves when a test works or a clock sleeps."""

    def __init__(self) -> None:
        self.now = START_NS
        self.slept_s: list[float] = []

    def now_ns(self) -> int:
        return self.now

    def sleep(self, duration_s: float) -> None:
        self.slept_s.append(duration_s)
        self.now += round(duration_s * 1e9)

    def work(self, periods: float) -> None:
        self.now += round(periods * PERIOD_NS)


def started() -> tuple[FakeTime, MonotonicClock]:
    time = FakeTime()
    clock = MonotonicClock(time.now_ns, time.sleep)
    clock.start(1e-3)
    return time, clock


def test_the_first_deadline_is_the_start() -> None:
    time, clock = started()
    assert clock.wait() == Tick(0, 0.0)
    assert time.slept_s == []


def test_on_time_it_sleeps_until_each_deadline() -> None:
    time, clock = started()
    for step in range(5):
        assert clock.wait() == Tick(step, 0.0)
        assert time.now == START_NS + step * PERIOD_NS
        time.work(0.4)


def test_late_by_less_than_a_period_nothing_is_skipped() -> None:
    time, clock = started()
    clock.wait()
    time.work(1.7)
    assert clock.wait() == Tick(1, 0.7e-3)
    time.work(0.1)
    assert clock.wait() == Tick(2, 0.0), "the lateness is made up for, the phase is kept"


def test_whole_periods_are_skipped_and_the_phase_is_kept() -> None:
    time, clock = started()
    clock.wait()
    time.work(3.25)
    assert clock.wait() == Tick(3, 0.25e-3)
    assert clock.wait() == Tick(4, 0.0)
    assert time.now == START_NS + 4 * PERIOD_NS


@settings(deadline=None)  # the first example compiles
@given(st.lists(st.floats(0.0, 4.0), min_size=1, max_size=40))
def test_every_step_begins_within_the_period_of_its_own_deadline(work: list[float]) -> None:
    time, clock = started()
    before = -1
    for periods in work:
        step, lateness_s = clock.wait()
        assert step > before
        assert round(lateness_s * 1e9) == time.now - (START_NS + step * PERIOD_NS)
        assert 0 <= time.now - (START_NS + step * PERIOD_NS) < PERIOD_NS
        before = step
        time.work(periods)


def test_starting_again_counts_from_there() -> None:
    time, clock = started()
    clock.wait()
    time.work(7.5)
    clock.start(2e-3)
    assert clock.wait() == Tick(0, 0.0)
    assert clock.wait() == Tick(1, 0.0)
    assert time.now == START_NS + 7_500_000 + 2_000_000


def test_simulated_time_never_waits_and_is_never_late() -> None:
    clock = SimulatedClock()
    clock.start(3600.0)
    assert [clock.wait() for _ in range(3)] == [Tick(0, 0.0), Tick(1, 0.0), Tick(2, 0.0)]
    clock.start(1.0)
    assert clock.wait() == Tick(0, 0.0)
