"""Which commands count, and what a device does with those that do not."""

from __future__ import annotations

import math

import pytest
from recording_plant import ManualClock, RecordingPlant

from plant_sim.device import SimulatedDevice
from rtctl.border.records import DeviceStatus

ENABLED, CLAMPED, REFUSED = DeviceStatus.ENABLED, DeviceStatus.CLAMPED, DeviceStatus.REFUSED


@pytest.fixture
def plant() -> RecordingPlant:
    return RecordingPlant()


@pytest.fixture
def device(plant: RecordingPlant) -> SimulatedDevice:
    """Enabled, in lockstep with a period of one second."""
    device = SimulatedDevice(plant)
    device.set_clock(lockstep=True, period_us=1_000_000)
    device.set_enable(True)
    return device


@pytest.mark.parametrize("sequence", [0, 1, 65535])
def test_first_command_counts_whatever_its_number(device: SimulatedDevice, sequence: int) -> None:
    reading = device.exchange((5.0,), sequence)
    assert reading.sensed == (1005.0,)
    assert reading.sequence == sequence
    assert reading.counter == 1


def test_repeated_sequence_number_changes_nothing(device: SimulatedDevice, plant: RecordingPlant) -> None:
    first = device.exchange((5.0,), 7)
    assert device.exchange((6.0,), 7) == first
    assert plant.levels == [5.0]


def test_sequence_number_may_wrap(device: SimulatedDevice, plant: RecordingPlant) -> None:
    for sequence in (65534, 65535, 0, 1):
        assert device.exchange((5.0,), sequence).sequence == sequence
    assert len(plant.holds) == 4


@pytest.mark.parametrize("level", [math.nan, math.inf, -math.inf, 3.5e38])
def test_what_is_no_finite_float32_is_refused_and_changes_nothing(
    device: SimulatedDevice, plant: RecordingPlant, level: float
) -> None:
    before = device.exchange((5.0,), 1)
    with pytest.raises(ValueError, match="command"):
        device.exchange((level,), 2)
    assert device.read() == before
    assert plant.levels == [5.0]
    assert device.exchange((5.0,), 2).counter == 2, "the refused number is still fresh"


def test_command_is_rounded_to_float32_like_on_a_wire(device: SimulatedDevice, plant: RecordingPlant) -> None:
    device.exchange((3.3,), 1)
    assert plant.levels == [3.299999952316284]


@pytest.mark.parametrize(("asked", "applied"), [(9.0, 8.0), (0.25, 1.0), (-5.0, 1.0)])
def test_command_beyond_the_limits_is_clamped_and_says_so(
    device: SimulatedDevice, plant: RecordingPlant, asked: float, applied: float
) -> None:
    assert device.exchange((asked,), 1).status == ENABLED | CLAMPED
    assert plant.levels == [applied]
    assert device.exchange((5.0,), 2).status == ENABLED


def test_limit_itself_is_not_clamped_where_float32_rounds_it(plant: RecordingPlant) -> None:
    plant.low = (3.3,)  # type: ignore[assignment]
    plant.high = (8.3,)  # type: ignore[assignment]
    device = SimulatedDevice(plant)
    device.set_clock(lockstep=True, period_us=1)
    device.set_enable(True)
    assert device.exchange((3.3,), 1).status == ENABLED
    assert device.exchange((8.3,), 2).status == ENABLED


def test_disabled_device_refuses_and_stays_off(device: SimulatedDevice, plant: RecordingPlant) -> None:
    before = device.exchange((5.0,), 1)
    device.set_enable(False)
    reading = device.exchange((5.0,), 2)
    assert reading.status == REFUSED
    assert reading.sequence == 1, "a refused command is not in force"
    assert reading.counter == before.counter
    assert plant.levels == [5.0]


def test_enabling_clears_the_refusal_and_the_refused_number_is_fresh(device: SimulatedDevice) -> None:
    device.set_enable(False)
    device.exchange((5.0,), 1)
    device.set_enable(True)
    assert device.read().status == ENABLED
    assert device.exchange((5.0,), 1).sensed == (1005.0,)


def test_disabling_switches_the_current_off_at_once() -> None:
    plant, clock = RecordingPlant(), ManualClock()
    device = SimulatedDevice(plant, clock)
    device.set_enable(True)
    device.command((5.0,), 1)
    clock.now_s += 2.0
    device.set_enable(False)
    clock.now_s += 3.0
    assert device.read().sensed == (1010.0,)
    assert plant.holds == [(5.0, 2.0), (0.0, 3.0)]


def test_enabled_device_stays_off_until_its_first_command() -> None:
    plant, clock = RecordingPlant(), ManualClock()
    device = SimulatedDevice(plant, clock)
    device.set_enable(True)
    clock.now_s += 1.0
    device.read()
    assert plant.levels == [0.0]


def test_reading_that_is_no_number_is_a_sensor_fault(device: SimulatedDevice, plant: RecordingPlant) -> None:
    plant.charge = math.nan
    assert device.exchange((5.0,), 1).status == ENABLED | DeviceStatus.SENSOR_FAULT
    plant.charge = 0.0
    assert device.exchange((5.0,), 2).status == ENABLED
