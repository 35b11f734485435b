"""A simulated source meter on a bench: the faults of its line strike it as they do other devices."""

from __future__ import annotations

from pathlib import Path

import pytest
from scpi_cases import driver_at, in_thread

from drivers.scpi.driver import ScpiDriver
from drivers.scpi.ports import serial_place
from plant_sim.wire.serve import Wires, served
from rtctl.border.errors import DriverError, Fault
from rtctl.scenario.serving import read_faults
from rtctl.wiring_served import build_bench

pytestmark = pytest.mark.wire

OPEN = {"lockstep_period_us": None, "watchdog_ms": 0, "timeout_s": 0.5}


def test_answers_that_are_dropped_are_missed(tmp_path: Path) -> None:
    faults = read_faults("drop rate=1.0 way=to_host", on_tcp=False)
    bench = build_bench("vo2_slow", 3, faults, has_journal=False, is_inspected=False)
    with in_thread(lambda: served(bench.device, Wires(scpi=str(tmp_path / "smu")), bench)):
        driver = driver_at(serial_place(str(tmp_path / "smu"), 9600), setup_timeout_s=0.2)
        with pytest.raises(DriverError, match=r"no answer to '\*IDN\?' within 200 ms: nothing came"):
            driver.open(**OPEN)


def exchange_until_it_breaks(driver: ScpiDriver) -> None:
    for _ in range(1000):
        driver.exchange((5.0,))


def open_once_it_is_back(driver: ScpiDriver) -> None:
    """Until then connections are refused, and there is no such port."""
    faults: list[Fault] = []
    while not faults or faults[-1] is Fault.CONNECTION_LOST:
        try:
            driver.open(**OPEN)
        except DriverError as error:
            faults.append(error.fault)
        else:
            return
    raise AssertionError(f"opened anew it said {faults[-1]}")


@pytest.mark.parametrize("wire", ["tcp", "pty"])
def test_a_line_that_breaks_is_told_and_the_driver_opens_again(wire: str, tmp_path: Path) -> None:
    faults = read_faults("disconnect at=0.1s duration=50ms", on_tcp=wire == "tcp")
    bench = build_bench("vo2_slow", 3, faults, has_journal=False, is_inspected=False)
    where = "127.0.0.1:0" if wire == "tcp" else str(tmp_path / "smu")
    with in_thread(lambda: served(bench.device, Wires(scpi=where), bench)) as ends:
        place = ends.split()[1]
        driver = driver_at(place if wire == "tcp" else serial_place(place, 9600), setup_timeout_s=1.0)
        driver.open(**OPEN)
        with pytest.raises(DriverError) as caught:
            exchange_until_it_breaks(driver)
        assert caught.value.fault in (Fault.CONNECTION_LOST, Fault.NO_ANSWER)
        driver.close((3.68,))
        open_once_it_is_back(driver)
        assert driver.exchange((5.0,)).sensed[0] > 500.0
        driver.close((3.68,))
        assert not bench.device.enabled
