"""A served device and the drivers together: the wire changes nothing, and the watchdog guards it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from peers import serving

from drivers.inprocess import InProcessDriver
from drivers.modbus import ModbusDriver, ModbusRtuDriver, ModbusTcpDriver
from drivers.serial_frames import SerialDriver
from plant_sim.catalogue import bundled_plant
from plant_sim.device import SimulatedDevice
from plant_sim.wire.serve import Wires
from rtctl.border.errors import DriverError, Fault
from rtctl.border.records import VO2, DeviceStatus, Driver, Measurement
from rtctl.wiring import load_plant

pytestmark = pytest.mark.wire

ENABLED, TRIPPED, REFUSED = DeviceStatus.ENABLED, DeviceStatus.WATCHDOG_TRIPPED, DeviceStatus.REFUSED


class ManualClock:
    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


def noisy_device(clock: ManualClock) -> SimulatedDevice:
    return SimulatedDevice(load_plant(bundled_plant("vo2_a"), seed=5), clock)


@pytest.fixture(params=["rtu", "tcp", "serial"])
def driver(
    request: pytest.FixtureRequest, clock: ManualClock, tmp_path: Path
) -> Iterator[ModbusDriver | SerialDriver]:
    """Not yet open, at the end of a wire to a device on a clock that the test moves."""
    device = noisy_device(clock)
    if request.param == "rtu":
        with serving(device, Wires(rtu_path=tmp_path / "port")):
            yield ModbusRtuDriver(port=str(tmp_path / "port"), baud=115200, unit=1, profile=VO2)
    elif request.param == "serial":
        with serving(device, Wires(serial_path=tmp_path / "port")):
            yield SerialDriver(port=str(tmp_path / "port"), baud=115200, profile=VO2, first_tag=0xFFFC)
    else:
        with serving(device, Wires(tcp="127.0.0.1:0")) as ends:
            port = int(ends.split()[1].rpartition(":")[2])
            yield ModbusTcpDriver(host="127.0.0.1", port=port, unit=1, profile=VO2)


def run(driver: Driver, levels: list[float]) -> list[Measurement]:
    first = driver.open(lockstep_period_us=1000, watchdog_ms=100, timeout_s=5.0)
    readings = [first, *(driver.exchange((level,)) for level in levels)]
    driver.close((0.0,))
    return readings


def test_wire_and_process_agree_to_the_last_bit(
    driver: ModbusDriver | SerialDriver, clock: ManualClock
) -> None:
    levels = np.random.default_rng(1).uniform(-1.0, 10.0, 1000).tolist()
    clock.now_s += 3.0  # the machine's time must not matter in lockstep
    over_the_wire = run(driver, levels)
    in_process = run(InProcessDriver(noisy_device(ManualClock())), levels)
    assert over_the_wire == in_process
    assert driver.identity == "VO2-A"
    assert len({reading.sensed for reading in over_the_wire}) > 900, "noise and commands move the readings"


def test_watchdog_trips_without_commands_and_opening_again_clears_it(
    driver: ModbusDriver | SerialDriver, clock: ManualClock
) -> None:
    driver.open(lockstep_period_us=None, watchdog_ms=100, timeout_s=5.0)
    assert driver.exchange((5.0,)).status == ENABLED
    clock.now_s += 0.2
    assert driver.exchange((5.0,)).status == ENABLED | TRIPPED | REFUSED
    driver.close((0.0,))
    assert driver.open(lockstep_period_us=None, watchdog_ms=100, timeout_s=5.0).status == ENABLED
    assert driver.exchange((5.0,)).status == ENABLED
    driver.close((0.0,))


@pytest.mark.parametrize("level", [math.nan, math.inf])
def test_level_that_is_no_number_is_refused_and_the_device_goes_on(
    driver: ModbusDriver | SerialDriver, level: float
) -> None:
    first = driver.open(lockstep_period_us=1000, watchdog_ms=0, timeout_s=5.0)
    with pytest.raises(DriverError, match=r"exception 3|error 3") as caught:
        driver.exchange((level,))
    assert caught.value.fault is Fault.COMMAND_REFUSED
    assert driver.exchange((5.0,)).counter == first.counter + 1
    driver.close((0.0,))


def test_closing_leaves_the_device_off(driver: ModbusDriver | SerialDriver, clock: ManualClock) -> None:
    driver.open(lockstep_period_us=None, watchdog_ms=0, timeout_s=5.0)
    driver.exchange((8.0,))
    clock.now_s += 0.1
    hot = driver.exchange((8.0,)).sensed[0]
    driver.close((8.0,))
    clock.now_s += 1.0
    cold = driver.open(lockstep_period_us=None, watchdog_ms=0, timeout_s=5.0).sensed[0]
    assert cold > 3.0 * hot, "a VO2 film that cools becomes an insulator"
    driver.close((0.0,))
