"""The driver without a wire keeps the promises of one with a wire."""

from __future__ import annotations

import math

import pytest

from drivers.inprocess import InProcessDriver
from plant_sim.catalogue import bundled_plant
from plant_sim.device import SimulatedDevice
from rtctl.border.errors import DriverError, Fault
from rtctl.border.records import DeviceStatus, Measurement
from rtctl.wiring import load_plant


@pytest.fixture
def device() -> SimulatedDevice:
    return SimulatedDevice(load_plant(bundled_plant("vo2_a")))


def test_opening_sets_clock_and_watchdog_enables_and_reads(device: SimulatedDevice) -> None:
    first = InProcessDriver(device).open(lockstep_period_us=500, watchdog_ms=40, timeout_s=1.0)
    assert (device.lockstep, device.period_us, device.watchdog_ms) == (True, 500, 40)
    assert (first.status, first.counter) == (DeviceStatus.ENABLED, 1)


def test_each_exchange_is_a_fresh_sample_also_after_opening_again(device: SimulatedDevice) -> None:
    counters = []
    for commands in (0, 3, 2):
        driver = InProcessDriver(device)
        driver.open(lockstep_period_us=1000, watchdog_ms=0, timeout_s=1.0)
        counters += [driver.exchange((5.0,)).counter for _ in range(commands)]
        driver.close((0.0,))
    assert counters == [3, 4, 5, 7, 8], "closing takes one sample at the safe level"


def test_sequence_number_wraps(device: SimulatedDevice) -> None:
    driver = InProcessDriver(device)
    driver.open(lockstep_period_us=1, watchdog_ms=0, timeout_s=1.0)
    driver._sequence = 65534
    assert [driver.exchange((5.0,)).sequence for _ in range(3)] == [65535, 0, 1]


def test_level_that_is_no_number_is_refused(device: SimulatedDevice) -> None:
    driver = InProcessDriver(device)
    driver.open(lockstep_period_us=1000, watchdog_ms=0, timeout_s=1.0)
    with pytest.raises(DriverError, match=r"VO2-A.*finite") as caught:
        driver.exchange((math.nan,))
    assert caught.value.fault is Fault.COMMAND_REFUSED


def test_impossible_settings_are_refused(device: SimulatedDevice) -> None:
    with pytest.raises(DriverError, match="watchdog must be"):
        InProcessDriver(device).open(lockstep_period_us=1000, watchdog_ms=70_000, timeout_s=1.0)


def test_closing_disables_and_never_raises(device: SimulatedDevice) -> None:
    driver = InProcessDriver(device)
    driver.open(lockstep_period_us=1000, watchdog_ms=0, timeout_s=1.0)
    driver.close((math.nan,))
    assert not device.enabled


def test_reply_to_another_command_is_stale(device: SimulatedDevice, monkeypatch: pytest.MonkeyPatch) -> None:
    driver = InProcessDriver(device)
    driver.open(lockstep_period_us=1000, watchdog_ms=0, timeout_s=1.0)
    reply = Measurement((1.0,), 0.0, 1, 0, 999, int(DeviceStatus.ENABLED))
    monkeypatch.setattr(device, "exchange", lambda levels, sequence: reply)
    with pytest.raises(DriverError, match="999") as caught:
        driver.exchange((5.0,))
    assert caught.value.fault is Fault.STALE_REPLY
