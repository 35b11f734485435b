"""Device time: lockstep, free-running, and the change between them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from recording_plant import ManualClock, RecordingPlant, forbidden_clock

from plant_sim.device import SimulatedDevice


def test_lockstep_holds_the_new_level_for_one_period_then_measures() -> None:
    plant = RecordingPlant()
    device = SimulatedDevice(plant)
    device.set_clock(lockstep=True, period_us=500_000)
    device.set_enable(True)
    first, second = device.exchange((2.0,), 1), device.exchange((4.0,), 2)
    assert plant.holds == [(2.0, 0.5), (4.0, 0.5)]
    assert (first.sensed, first.reference, first.time_us) == ((1001.0,), -1.0, 500_000)
    assert (second.sensed, second.reference, second.time_us) == ((1003.0,), -3.0, 1_000_000)


def test_lockstep_never_looks_at_the_clock() -> None:
    device = SimulatedDevice(RecordingPlant(), ManualClock())
    device.set_clock(lockstep=True, period_us=1000)
    device._clock = forbidden_clock
    device.set_watchdog(100)
    device.set_enable(True)
    assert device.exchange((5.0,), 1).counter == 1
    device.set_enable(False)


def test_lockstep_reading_stays_until_the_next_fresh_command() -> None:
    plant = RecordingPlant()
    device = SimulatedDevice(plant)
    device.set_clock(lockstep=True, period_us=1000)
    device.set_enable(True)
    before_any_command = device.read()
    assert device.read() == before_any_command
    after = device.exchange((5.0,), 1)
    assert device.read() == after == device.read()
    assert plant.readings == 2


def test_free_running_reading_is_from_before_the_command_takes_effect() -> None:
    plant, clock = RecordingPlant(), ManualClock()
    device = SimulatedDevice(plant, clock)
    device.set_enable(True)
    assert device.exchange((2.0,), 1).sensed == (1000.0,)
    clock.now_s += 1.0
    assert device.exchange((4.0,), 2).sensed == (1002.0,)
    clock.now_s += 0.5
    reading = device.read()
    assert (reading.sensed, reading.time_us, reading.counter) == ((1004.0,), 1_500_000, 3)


def test_lockstep_run_does_not_depend_on_how_long_the_device_waited() -> None:
    plant, clock = RecordingPlant(), ManualClock()
    device = SimulatedDevice(plant, clock)
    for _ in range(3):
        clock.now_s += 1.0
        device.read()
    device.set_clock(lockstep=True, period_us=500_000)
    device.set_enable(True)
    reading = device.exchange((2.0,), 1)
    assert (reading.time_us, reading.counter) == (500_000, 1)
    assert plant.holds == [(2.0, 0.5)]


def test_device_time_goes_on_when_the_clock_changes_over() -> None:
    plant, clock = RecordingPlant(), ManualClock()
    device = SimulatedDevice(plant, clock)
    device.set_enable(True)
    device.command((4.0,), 1)
    clock.now_s += 1.0
    device.set_clock(lockstep=True, period_us=250_000)
    clock.now_s += 50.0
    assert device.exchange((2.0,), 2).time_us == 1_250_000
    device.set_clock(lockstep=False, period_us=0)
    clock.now_s += 0.5
    reading = device.read()
    assert (reading.time_us, reading.sensed) == (1_750_000, (1005.5,))
    assert device.period_us == 250_000, "free-running may leave the period out"


def test_device_time_and_its_word_wrap_at_32_bits() -> None:
    device = SimulatedDevice(RecordingPlant())
    device.set_clock(lockstep=True, period_us=2**32 - 1)
    device.set_enable(True)
    assert device.exchange((5.0,), 1).time_us == 2**32 - 1
    assert device.exchange((5.0,), 2).time_us == 2**32 - 2


@pytest.mark.parametrize("period_us", [0, -1, 2**32])
def test_impossible_period_is_refused(period_us: int) -> None:
    device = SimulatedDevice(RecordingPlant())
    with pytest.raises(ValueError, match="sample period must be"):
        device.set_clock(lockstep=True, period_us=period_us)
    assert not device.lockstep


ACTIONS = st.one_of(
    st.tuples(st.just("command"), st.floats(-20.0, 20.0, width=32), st.integers(0, 3)),
    st.tuples(st.just("enable"), st.booleans()),
    st.tuples(st.just("watchdog"), st.sampled_from([0, 5, 100])),
    st.tuples(st.just("clock"), st.booleans(), st.sampled_from([1000, 7_000])),
    st.tuples(st.just("wait"), st.integers(0, 200_000)),
    st.tuples(st.just("read")),
)


@given(st.lists(ACTIONS, max_size=40))
def test_plant_lives_exactly_device_time_at_levels_it_may_have(actions: list[tuple[object, ...]]) -> None:
    plant, clock = RecordingPlant(), ManualClock()
    device = SimulatedDevice(plant, clock)
    for action, *arguments in actions:
        match action, arguments:
            case "command", [level, sequence]:
                device.command((level,), sequence)  # type: ignore[arg-type]
            case "enable", [on]:
                device.set_enable(bool(on))
            case "watchdog", [period_ms]:
                device.set_watchdog(period_ms)  # type: ignore[arg-type]
            case "clock", [lockstep, period_us]:
                device.set_clock(lockstep=bool(lockstep), period_us=period_us)  # type: ignore[arg-type]
            case "wait", [time_us]:
                clock.now_s += 1e-6 * time_us  # type: ignore[operator]
            case _:
                device.read()
    time_us = device.read().time_us
    assert sum(dt_s for _, dt_s in plant.holds) == pytest.approx(1e-6 * time_us, abs=1e-9)
    assert all(level in (0.0, 0.5) or 1.0 <= level <= 8.0 for level in plant.levels)
