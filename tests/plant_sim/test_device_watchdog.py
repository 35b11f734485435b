"""The watchdog: a command is a lease, and only a fresh accepted command renews it."""

from __future__ import annotations

import math

import pytest
from recording_plant import ManualClock, RecordingPlant

from plant_sim.device import SimulatedDevice
from rtctl.border.records import DeviceStatus

ENABLED, TRIPPED, REFUSED = DeviceStatus.ENABLED, DeviceStatus.WATCHDOG_TRIPPED, DeviceStatus.REFUSED


class Bench:
    """A free-running enabled device with a watchdog of 250 ms."""

    def __init__(self) -> None:
        self.plant, self.clock = RecordingPlant(), ManualClock()
        self.device = SimulatedDevice(self.plant, self.clock)
        self.device.set_watchdog(250)
        self.device.set_enable(True)

    def status_after(self, wait_s: float) -> int:
        self.clock.now_s += wait_s
        return self.device.read().status


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def tripped(bench: Bench) -> Bench:
    bench.device.exchange((5.0,), 1)
    assert bench.status_after(1.0) == ENABLED | TRIPPED
    return bench


def test_sleeps_until_the_first_command(bench: Bench) -> None:
    assert bench.status_after(1000.0) == ENABLED
    bench.device.exchange((5.0,), 1)
    assert bench.status_after(0.25) == ENABLED
    assert bench.status_after(0.001) == ENABLED | TRIPPED


def test_trips_at_its_exact_time_however_late_the_device_is_looked_at(bench: Bench) -> None:
    bench.device.exchange((5.0,), 1)
    bench.clock.now_s += 1.0
    bench.device.read()
    assert bench.plant.holds == [(5.0, 0.25), (0.5, 0.75)]


def test_fresh_commands_renew_the_lease(bench: Bench) -> None:
    for sequence in range(10):
        bench.device.exchange((5.0,), sequence)
        assert bench.status_after(0.2) == ENABLED


def test_frozen_sequence_number_does_not(bench: Bench) -> None:
    bench.device.exchange((5.0,), 1)
    bench.clock.now_s += 0.2
    bench.device.exchange((5.0,), 1)
    assert bench.status_after(0.1) == ENABLED | TRIPPED


def test_refused_command_does_not(bench: Bench) -> None:
    bench.device.exchange((5.0,), 1)
    bench.clock.now_s += 0.2
    with pytest.raises(ValueError, match="finite"):
        bench.device.exchange((math.nan,), 2)
    assert bench.status_after(0.1) == ENABLED | TRIPPED


def test_zero_is_no_watchdog(bench: Bench) -> None:
    bench.device.set_watchdog(0)
    bench.device.exchange((5.0,), 1)
    assert bench.status_after(1e6) == ENABLED


def test_tripped_device_refuses_and_keeps_sensing(tripped: Bench) -> None:
    before = tripped.device.read()
    tripped.clock.now_s += 1.0
    reading = tripped.device.exchange((5.0,), 2)
    assert reading.status == ENABLED | TRIPPED | REFUSED
    assert (reading.sequence, reading.counter) == (1, before.counter + 1)
    assert tripped.plant.holds[-1] == (0.5, 1.0)


def test_enable_written_1_alone_does_not_rearm(tripped: Bench) -> None:
    tripped.device.set_enable(True)
    assert tripped.device.read().status == ENABLED | TRIPPED


def test_enable_0_keeps_the_trip_visible_then_1_clears_it(tripped: Bench) -> None:
    tripped.device.set_enable(False)
    assert tripped.device.read().status == TRIPPED
    tripped.device.set_enable(True)
    assert tripped.device.read().status == ENABLED


def test_rearmed_watchdog_sleeps_until_the_next_command(tripped: Bench) -> None:
    tripped.device.set_enable(False)
    tripped.device.set_enable(True)
    assert tripped.status_after(10.0) == ENABLED
    tripped.device.exchange((5.0,), 2)
    assert tripped.status_after(0.3) == ENABLED | TRIPPED


def test_replayed_frame_does_not_restart_a_rearmed_device(tripped: Bench) -> None:
    tripped.device.set_enable(False)
    tripped.device.set_enable(True)
    tripped.device.exchange((5.0,), 1)
    tripped.status_after(1.0)
    assert tripped.plant.holds[-1] == (0.0, 1.0)


@pytest.mark.parametrize("watchdog_ms", [-1, 65536])
def test_watchdog_beyond_its_register_is_refused(bench: Bench, watchdog_ms: int) -> None:
    with pytest.raises(ValueError, match="watchdog must be"):
        bench.device.set_watchdog(watchdog_ms)


def lockstep_device(plant: RecordingPlant, watchdog_ms: int) -> SimulatedDevice:
    device = SimulatedDevice(plant)
    device.set_clock(lockstep=True, period_us=100_000)
    device.set_watchdog(watchdog_ms)
    device.set_enable(True)
    return device


@pytest.mark.parametrize("watchdog_ms", [0, 100, 1000])
def test_lockstep_never_trips_between_samples(watchdog_ms: int) -> None:
    device = lockstep_device(RecordingPlant(), watchdog_ms)
    assert [device.exchange((5.0,), n).status for n in range(50)] == [ENABLED] * 50


def test_lockstep_trips_inside_a_period_that_exceeds_the_watchdog() -> None:
    plant = RecordingPlant()
    device = lockstep_device(plant, 75)
    assert device.exchange((5.0,), 1).status == ENABLED | TRIPPED
    assert plant.holds == [(5.0, pytest.approx(0.075)), (0.5, pytest.approx(0.025))]
    assert device.exchange((5.0,), 2).status == ENABLED | TRIPPED | REFUSED
