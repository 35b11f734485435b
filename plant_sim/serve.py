"""Simulated hardware for whoever connects: a plant on a pty, a TCP port or both, until a signal ends it."""

from __future__ import annotations

import asyncio
import gc
import signal
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path

from plant_sim.device import SimulatedDevice
from plant_sim.modbus_server import UNIT, serve_rtu, serve_tcp
from plant_sim.plant import Plant
from plant_sim.register_file import RegisterFile
from plant_sim.virtual_port import virtual_port
from rtctl.border.errors import InputError


def serve(plant: Plant, *, rtu_path: Path | None = None, tcp: str | None = None) -> None:
    """Serve `plant` until SIGINT or SIGTERM; prints one line `ready ...` when clients may connect.

    `rtu_path`: where the serial port appears; `tcp`: HOST:PORT, port 0 for a free one. Raises InputError.
    """
    plant.step(plant.safe, 1e-3)  # compiles what a client would otherwise wait for
    plant.reset()
    asyncio.run(_serve_until_signal(SimulatedDevice(plant), rtu_path, tcp))


@asynccontextmanager
async def served(device: SimulatedDevice, rtu_path: Path | None, tcp: str | None) -> AsyncIterator[str]:
    """Serve while the block runs; yields what is served where, for the `ready` line. Raises InputError."""
    if rtu_path is None and tcp is None:
        raise InputError("nothing to serve on: give a path for Modbus RTU or HOST:PORT for Modbus TCP")
    registers = RegisterFile(device)
    ends: list[str] = []
    async with AsyncExitStack() as stack:
        if rtu_path is not None:
            master = stack.enter_context(virtual_port(rtu_path))
            await stack.enter_async_context(serve_rtu(registers, master))
            ends.append(f"modbus-rtu {rtu_path}")
        if tcp is not None:
            host, port = parse_address(tcp)
            try:
                port = await stack.enter_async_context(serve_tcp(registers, host, port))
            except OSError as error:
                raise InputError(f"{tcp}: cannot serve there: {error.strerror or error}") from None
            ends.append(f"modbus-tcp {f'[{host}]' if ':' in host else host}:{port}")
        yield f"{' '.join(ends)} unit {UNIT} identity {device.identity}"


def parse_address(address: str) -> tuple[str, int]:
    """HOST:PORT, an IPv6 host in brackets. Raises InputError."""
    host, colon, port = address.rpartition(":")
    if not colon or not host or not port.isdecimal() or int(port) > 0xFFFF:
        raise InputError(f'"{address}": an address is HOST:PORT, such as 127.0.0.1:5020')
    return host.removeprefix("[").removesuffix("]"), int(port)


async def _serve_until_signal(device: SimulatedDevice, rtu_path: Path | None, tcp: str | None) -> None:
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    async with served(device, rtu_path, tcp) as ends:
        gc.freeze()  # a full collection would stop the device for tens of milliseconds
        print(f"ready {ends}", flush=True)
        await stop.wait()
