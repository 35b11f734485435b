"""A device whose watchdog counts the wall's time, in lockstep: no command that it holds is without end."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import foreign_wire_server
import pytest
from foreign_wire_benches import wire_bench
from foreign_wire_film import Film
from foreign_wire_registers import ENABLED, TRIPPED, Registers

import rtctl
from rtctl.border.errors import RunError

pytestmark = pytest.mark.wire
AT = 100
"""The command at which it happens: on the way of the first record, well above the safe level."""
SCENARIO = {
    "scenario": {"title": "levels", "plant": "vo2", "period": "1 ms"},
    "excitation": [{"kind": "levels", "hold": "60 ms", "levels": ["50 %", "80 %", "20 %"]}],
}
TIMEOUT = "0.2 s"


class Watched(Registers):
    """The registers of a foreign device; a test winds the watchdog's clock, and `act` comes before command `AT`."""

    def __init__(self, act: Callable[[], None]) -> None:
        self.now, self.commands = 0.0, 0
        self._act = act
        bench = wire_bench(0)
        super().__init__(bench, Film(bench.device), "foreign 0", 0, lambda: self.now)

    @property
    def current_mA(self) -> float:
        """What the film carries."""
        return self._current

    @property
    def status(self) -> int:
        """Register 104, as the watchdog leaves it now."""
        return self.read(104, 1)[0]

    def _command(self, current: float, sequence: int) -> None:
        super()._command(current, sequence)
        self.commands += 1
        if self.commands == AT:
            self._act()


def served(act: Callable[[Watched], None]) -> tuple[Watched, str]:
    """The device behind a port of its own, and its address."""
    device = Watched(lambda: act(device))
    listener = foreign_wire_server.listen()
    threading.Thread(target=foreign_wire_server.serve, args=(listener, device), daemon=True).start()
    host, port = listener.getsockname()
    return device, f"{host}:{port}"


def acquire(address: str, folder: Path) -> None:
    """Acquire in lockstep, with nothing of the clock but the timeout."""
    driver = {"kind": "modbus-tcp", "address": address}
    rtctl.acquire({**SCENARIO, "clock": {"timeout": TIMEOUT}}, folder, driver=driver)


def test_a_killed_host_leaves_a_device_that_switches_itself_off(tmp_path: Path) -> None:
    reached, killed = threading.Event(), threading.Event()

    def act(_: Watched) -> None:
        reached.set()
        killed.wait()

    device, address = served(act)
    words = ["acquire", "acquire_vo2", "--out", "data", "--quiet"]
    where = ["--set", "driver.kind=modbus-tcp", "--set", f"driver.address={address}"]
    with subprocess.Popen([sys.executable, "-m", "rtctl", *words, *where], cwd=tmp_path) as host:
        assert reached.wait(60.0)
        host.kill()
        host.wait()
    killed.set()
    assert device.current_mA > 3.0, "it holds the last command for a while"
    device.now = 30.0
    assert device.status & (ENABLED | TRIPPED) == ENABLED
    device.now = 61.0
    assert device.status & TRIPPED
    assert device.current_mA == 0.0


def test_a_host_that_pauses_for_half_a_minute_goes_on(tmp_path: Path) -> None:
    def act(device: Watched) -> None:
        device.now += 30.0

    device, address = served(act)
    acquire(address, tmp_path)
    assert device.commands > 2 * AT
    assert device.current_mA == 0.0


def test_a_fault_says_at_which_current_a_deaf_device_was_left(tmp_path: Path) -> None:
    woken = threading.Event()

    def act(_: Watched) -> None:
        woken.wait()

    device, address = served(act)
    with pytest.raises(RunError) as raised:
        acquire(address, tmp_path)
    held = device.current_mA
    woken.set()
    told = re.search(
        r"no_answer: .*acknowledged is current ([\d.]+) mA; that it is switched off, it did NOT acknowledge, "
        r"so it may stay there until its watchdog trips, 60 s after",
        str(raised.value),
    )
    assert told is not None, str(raised.value)
    assert float(told[1]) == pytest.approx(held, rel=1e-4)


def test_a_fault_says_that_the_device_acknowledged_to_be_off(tmp_path: Path) -> None:
    def act(device: Watched) -> None:
        device._readings = (float("nan"), 0.0)

    device, address = served(act)
    with pytest.raises(
        RunError, match=r"not_finite: .*is current [\d.]+ mA; then it acknowledged that it is"
    ):
        acquire(address, tmp_path)
    assert device.current_mA == 0.0
