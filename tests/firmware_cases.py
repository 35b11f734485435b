"""The firmware as programs: built for this computer and for an emulated Cortex-M4F, and asked byte by byte."""

from __future__ import annotations

import os
import select
import shutil
import subprocess
import sys
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import pytest

from rtctl.border.errors import RtctlError
from rtctl.border.records import VO2, DeviceStatus, Measurement
from rtctl.border.wire.serial_frames import (
    FrameReader,
    Layout,
    Message,
    Request,
    Settings,
    frame,
    settings_payload,
)
from rtctl.cli import main
from rtctl.recording.layout import Rows

HOST, MPS2 = "build/rtctl_host", "build/rtctl_mps2.elf"
DEADLINE_S = 20.0
"""For one answer of a device on a machine that is busy."""


def sources(folder: Path, film: str | Path = "vo2_a") -> Path:
    """The folder as `rtctl firmware` writes it."""
    assert main(["firmware", str(film), "--out", str(folder), "--quiet"]) == 0
    return folder


def host_program(folder: Path, film: str | Path = "vo2_a", *words: str) -> Path:
    """The device as a program of this computer; skips the test where there is no gcc or make."""
    return _made(folder, film, HOST, ("gcc", "make"), "host", *words)


def mps2_image(folder: Path, *words: str) -> Path:
    """The device for the emulated board; skips the test where the compiler or the emulator is missing."""
    return _made(folder, "vo2_a", MPS2, ("arm-none-eabi-gcc", "qemu-system-arm", "make"), "mps2", *words)


def _made(folder: Path, film: str | Path, product: str, tools: tuple[str, ...], *words: str) -> Path:
    """What `make` with these words builds; warnings are errors there."""
    missing = [tool for tool in tools if shutil.which(tool) is None]
    if missing:
        pytest.skip(f"{', '.join(missing)} missing (Debian: gcc-arm-none-eabi, qemu-system-arm, gcc, make)")
    command = ["make", "-C", sources(folder, film), *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / product


def emulator(image: Path, serial: str, machine: str = "mps2-an386") -> list[str]:
    """The command that runs an image with the board's serial line at `serial`."""
    quiet = ["-display", "none", "-monitor", "none"]
    return ["qemu-system-arm", "-machine", machine, *quiet, "-serial", serial, "-kernel", str(image)]


class Board:
    """A device at a line whose ends are file descriptors."""

    def __init__(self, to_device: int, from_device: int, beside: IO[bytes] | None = None) -> None:
        self._in, self._out, self._beside = to_device, from_device, beside
        self._reader = FrameReader()

    def answer(self, request: bytes) -> bytes:
        """The bytes of one answer."""
        self.send(request)
        data = b""
        while len(data) < 2 or data[-1] != 0:
            data += self._received(f"no answer to {request.hex(' ')}")
        return data

    def ask(self, kind: int, tag: int, payload: bytes = b"") -> Message:
        """The answer to a message."""
        (message,) = self._reader.feed(self.answer(frame(kind, tag, payload)))
        return message

    def send(self, request: bytes) -> None:
        """Without waiting for an answer; fails where the device takes no bytes."""
        assert select.select([], [self._in], [], DEADLINE_S)[1], f"no byte was taken within {DEADLINE_S:g} s"
        os.write(self._in, request)

    def told(self, lines: int) -> list[bytes]:
        """Lines of its standard error, waited for."""
        assert self._beside is not None
        return [self._beside.readline() for _ in range(lines)]

    def assert_silent(self, time_s: float) -> None:
        """For so long nothing arrives."""
        answers = b""
        while select.select([self._out], [], [], time_s)[0]:  # answers that the lost host has not read
            answers += os.read(self._out, 4096)
            assert len(answers) < 10_000, "it talks unasked"

    def _received(self, message: str) -> bytes:
        assert select.select([self._out], [], [], DEADLINE_S)[0], f"{message} within {DEADLINE_S:g} s"
        return os.read(self._out, 4096)


@contextmanager
def board(command: list[str]) -> Iterator[Board]:
    """A device started by `command`, with its serial line on standard input and output."""
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe) as process:
        try:
            assert process.stdin is not None
            assert process.stdout is not None
            yield Board(process.stdin.fileno(), process.stdout.fileno(), process.stderr)
        finally:
            process.kill()


@contextmanager
def at_port(port: str | Path) -> Iterator[Board]:
    """The device behind a pseudo-terminal that no other program has open."""
    line = os.open(port, os.O_RDWR | os.O_NOCTTY)
    try:
        tty.setraw(line)
        yield Board(line, line)
    finally:
        os.close(line)


def host_board(program: Path) -> list[str]:
    """The command of the program of this computer."""
    return [str(program), "-"]


@contextmanager
def on_terminal(program: Path, link: Path) -> Iterator[list[str]]:
    """The program of this computer behind a pseudo-terminal; the `--set` options that lead a scenario there."""
    with subprocess.Popen([program, link], stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == b"ready\n"
            yield ["--set", "driver.kind=serial", "--set", f"driver.port={link}"]
        finally:
            process.kill()


HOT = """
[scenario]
title = "a hot level for ever"
period = "10 ms"
[clock]
mode = "live"
timeout = "5 s"
watchdog = "1 s"
[[excitation]]
kind = "levels"
hold = "600 s"
levels = ["80 %"]
"""


def kill_a_host_that_heats(port: str | Path, folder: Path) -> None:
    """Run a level live through the port, with a watchdog of 1 s; kill the program once it has recorded some rows."""
    scenario, out = folder / "hot.toml", folder / "hot"
    scenario.write_text(HOT, encoding="utf-8")
    wire = ["--set", "driver.kind=serial", "--set", f"driver.port={port}"]
    words = [sys.executable, "-m", "rtctl", "acquire", str(scenario), "--out", str(out), *wire]
    with subprocess.Popen(words, stderr=subprocess.PIPE) as host:
        try:
            assert host.stderr is not None
            assert b"levels" in host.stderr.readline(), "it does not tell what it plays"
            wait_until(lambda: recorded_rows(out) >= 20, "no rows were recorded")
        finally:
            host.kill()


def recorded_rows(folder: Path) -> int:
    """Rows that an acquisition under way has recorded; 0 before it has begun."""
    try:
        return len(Rows(folder / "acquiring" / "signals.rec"))
    except (RtctlError, OSError):
        return 0


def assert_cools_and_waits_for_re_arming(device: Board) -> None:
    """A device whose host was lost trips, takes its safe current (0 mA), refuses commands until enable is 0, then 1."""
    layout = Layout(VO2)

    def ask(kind: Request, tag: int, payload: bytes = b"") -> Measurement:
        reading = layout.measurement(device.ask(kind, tag, payload).payload)
        assert reading is not None
        return reading

    device.assert_silent(2.0)  # the lease ends without a byte from anywhere
    cold = ask(Request.READ, 1)
    assert cold.status & DeviceStatus.WATCHDOG_TRIPPED
    assert cold.sensed[0] > COLD_OHM, "the current ended only when somebody asked"
    refused = ask(Request.COMMAND, cold.sequence ^ 0x8000, layout.command([8.0]))
    assert refused.status & (DeviceStatus.REFUSED | DeviceStatus.WATCHDOG_TRIPPED) == 2 | 16
    for enable in (0, 1):
        device.ask(Request.SETTINGS, 4, settings_payload(Settings(enable, 0, 0, 0)))
    again = ask(Request.COMMAND, refused.sequence ^ 0x4000, layout.command([8.0]))
    assert again.status == DeviceStatus.ENABLED
    wait_until(lambda: ask(Request.READ, 5).sensed[0] < 0.2 * COLD_OHM, "a re-armed device does not heat")


COLD_OHM = 180e3
"""Resistance above which vo2_a carries no current: 187 kohm at 23 degC."""


def wait_until(holds: Callable[[], object], message: str) -> None:
    """Return once something holds; fails after the deadline."""
    deadline_s = time.monotonic() + DEADLINE_S
    while not holds():
        assert time.monotonic() < deadline_s, f"{message} within {DEADLINE_S:g} s"
