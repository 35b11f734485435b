"""Simulated hardware on a wire: a plant on a pty, a TCP port or several, until a signal ends it."""

from __future__ import annotations

import asyncio
import errno
import gc
import signal
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from plant_sim.bench.under_way import Bench
from plant_sim.device import SimulatedDevice
from plant_sim.journal import JournalledDevice
from plant_sim.plant import Plant
from plant_sim.wire.faulty_wire import FaultyWire
from plant_sim.wire.modbus_server import UNIT, RtuDevice, serve_tcp
from plant_sim.wire.pty_server import Answer, PortEnd, serve_pty
from plant_sim.wire.register_file import RegisterFile
from plant_sim.wire.scpi.models import INSTRUMENTS
from plant_sim.wire.scpi.server import Answering, serve_lines_pty, serve_lines_tcp
from plant_sim.wire.scpi.voltmeter import voltmeter
from plant_sim.wire.serial_server import SerialDevice
from rtctl.border.errors import InputError, nearest


@dataclass(frozen=True, slots=True, kw_only=True)
class Wires:
    """The wires on which a device is served; at least one is given."""

    rtu_path: Path | None = None
    """Path at which a serial port with Modbus RTU appears."""
    serial_path: Path | None = None
    """Path at which a serial port with the plain serial protocol appears."""
    tcp: str | None = None
    """HOST:PORT of Modbus TCP, port 0 for a free one."""
    scpi: str | None = None
    """HOST:PORT, or path of a serial port, of a source meter in front of the device."""
    instrument: str = "keithley-2450"
    """Which source meter."""
    voltmeter: str | None = None
    """HOST:PORT, or path of a serial port, of a voltmeter at the device's external instrument."""
    baud: int | None = None
    """Baud rate of the serial ports [bit/s]: bytes take their time on the line; None: none, as ptys do."""

    def __post_init__(self) -> None:
        if self.rtu_path is None and self.serial_path is None and self.tcp is None and self.scpi is None:
            raise InputError(
                "nothing to serve on: give a path for Modbus RTU or the serial protocol, HOST:PORT for Modbus TCP, or "
                "either of them for a source meter"
            )
        if self.instrument not in INSTRUMENTS:
            raise InputError(
                f'no simulated instrument "{self.instrument}"{nearest(self.instrument, INSTRUMENTS)}'
            )
        if self.baud is not None and not self.baud > 0:
            raise InputError(f"the baud rate must be > 0 bit/s, got {self.baud}")


LOOK_EVERY_S = 0.02
"""How often a device on a bench is asked what it does, and its changes are made, beside the host's requests [s]."""


def serve(plant: Plant, wires: Wires, journal: Path | None = None) -> None:
    """Serve `plant` until SIGINT, SIGTERM or SIGHUP; print one line `ready ...` once clients may connect.

    SIGUSR1 restarts the device.

    Args:
        plant: the plant inside the device.
        wires: where to serve it.
        journal: file to which the device writes, at the end, what it did; None: none.

    Raises:
        InputError: an address cannot be served.
    """
    plant.step(plant.safe, 1e-3)  # compiles what a client would otherwise wait for
    plant.reset()
    if journal is None:
        asyncio.run(_serve_until_signal(SimulatedDevice(plant), wires))
        return
    device = JournalledDevice(plant)
    try:
        asyncio.run(_serve_until_signal(device, wires))
    finally:
        device.write_journal(journal)


def serve_bench(bench: Bench, wires: Wires, journal: Path | None = None) -> None:
    """Serve a device on a bench as `serve` does; its device keeps a journal where one is asked for."""
    try:
        asyncio.run(_serve_until_signal(bench.device, wires, bench))
    finally:
        if journal is not None and isinstance(bench.device, JournalledDevice):
            bench.device.write_journal(journal)


def _why(error: OSError) -> str:
    """Return in words why an address cannot be had."""
    if error.errno == errno.EADDRINUSE:
        return "the port is taken by another program; choose another one, or 0 for a free one"
    return error.strerror or str(error)


@asynccontextmanager
async def served(device: SimulatedDevice, wires: Wires, bench: Bench | None = None) -> AsyncIterator[str]:
    """Serve while the block runs; yield what is served where, for the `ready` line. Raises InputError."""
    registers = RegisterFile(device)
    restart_on_signal(registers)
    faults = None if bench is None else FaultyWire(bench.line, registers.power_cycle)
    ends: list[str] = []
    async with AsyncExitStack() as stack:
        if bench is not None:
            looking = asyncio.create_task(_look(bench))
            stack.callback(looking.cancel)

        def on_a_port(path: Path, answer: Answer) -> None:
            end = PortEnd(path, lambda master: serve_pty(answer, master, wires.baud, faults), faults)
            stack.callback(end.close)

        if wires.rtu_path is not None:
            on_a_port(wires.rtu_path, RtuDevice(registers).receive)
            ends.append(f"modbus-rtu {wires.rtu_path}")
        if wires.serial_path is not None:
            on_a_port(wires.serial_path, SerialDevice(device).receive)
            ends.append(f"serial {wires.serial_path}")

        async def on_a_socket(
            address: str, server: Callable[[str, int], AbstractAsyncContextManager[int]]
        ) -> str:
            host, port = parse_address(address)
            try:
                port = await stack.enter_async_context(server(host, port))
            except OSError as error:
                raise InputError(f"{address}: cannot serve there: {_why(error)}") from None
            return f"{f'[{host}]' if ':' in host else host}:{port}"

        async def instrument_at(where: str, instrument: Answering, line: FaultyWire | None) -> str:
            if is_address(where):
                return await on_a_socket(where, partial(serve_lines_tcp, instrument, faults=line))
            end = PortEnd(
                Path(where), lambda master: serve_lines_pty(instrument, master, wires.baud, line), line
            )
            stack.callback(end.close)
            return where

        if wires.tcp is not None:
            server = partial(serve_tcp, registers, faults=faults)
            ends.append(f"modbus-tcp {await on_a_socket(wires.tcp, server)}")
        if wires.scpi is not None:
            ends.append(
                f"scpi {await instrument_at(wires.scpi, INSTRUMENTS[wires.instrument](device), faults)}"
            )
        if wires.voltmeter is not None:
            ends.append(f"voltmeter {await instrument_at(wires.voltmeter, voltmeter(device), None)}")
        yield f"{' '.join(ends)} unit {UNIT} identity {device.identity}"


def restart_on_signal(registers: RegisterFile) -> None:
    """Let SIGUSR1 power-cycle the device, if this is the main thread."""
    with suppress(ValueError, RuntimeError):
        asyncio.get_running_loop().add_signal_handler(signal.SIGUSR1, registers.power_cycle)


LARGEST_PORT = 0xFFFF


def parse_address(address: str) -> tuple[str, int]:
    """Return host and port of HOST:PORT, an IPv6 host in brackets. Raises InputError."""
    host, colon, port = address.rpartition(":")
    if not colon or not host or not port.isdecimal():
        raise InputError(f'"{address}": an address is HOST:PORT, such as 127.0.0.1:5020')
    if int(port) > LARGEST_PORT:
        raise InputError(f'"{address}": port {port} is above {LARGEST_PORT}, the largest that there is')
    return host.removeprefix("[").removesuffix("]"), int(port)


def is_address(where: str) -> bool:
    """Return whether `where` is HOST:PORT rather than a path."""
    return "/" not in where and where.rpartition(":")[2].isdecimal() and ":" in where


async def _look(bench: Bench) -> None:
    while True:
        bench.look()
        await asyncio.sleep(LOOK_EVERY_S)


async def _serve_until_signal(device: SimulatedDevice, wires: Wires, bench: Bench | None = None) -> None:
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    numbers = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # under nohup it stays ignored
        numbers.append(signal.SIGHUP)
    for number in numbers:
        loop.add_signal_handler(number, stop.set)
    async with served(device, wires, bench) as ends:
        gc.freeze()  # a full collection would stop the device for tens of milliseconds
        print(f"ready {ends}", flush=True)
        await stop.wait()
