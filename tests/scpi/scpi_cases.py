"""Simulated instruments in a thread of the test, sound ones and ones that answer otherwise than they should."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager, contextmanager
from pathlib import Path
from queue import SimpleQueue
from typing import TypeVar

from drivers.scpi.driver import ScpiDriver
from drivers.scpi.instrument import Instrument
from drivers.scpi.ports import Place, tcp_place
from drivers.scpi.settings import SourceSettings
from drivers.scpi.table import load_table
from plant_sim.catalogue import bundled_plant
from plant_sim.journal import JournalledDevice
from plant_sim.wire.scpi.models import INSTRUMENTS
from plant_sim.wire.scpi.server import Answering
from plant_sim.wire.serve import Wires, served
from rtctl.border.records import VO2
from rtctl.wiring import load_plant

T = TypeVar("T")
LOW_A, HIGH_A = 3.68e-3, 8.49e-3
TABLES = tuple(INSTRUMENTS)


class SlowDevice(JournalledDevice):
    """The bundled device for source meters; it notes what reaches its plant.

    It says when it is switched off, and when it has had `enough` commands.
    """

    def __init__(self, enough: int = 1) -> None:
        plant = load_plant(bundled_plant("vo2_slow"), seed=3)
        plant.step(plant.safe, 1e-3)  # compiles what a client would otherwise wait for
        plant.reset()
        self.went_off, self.has_enough = threading.Event(), threading.Event()
        self._left = enough
        super().__init__(plant)

    def set_enable(self, on: bool) -> None:
        """As a device does."""
        super().set_enable(on)
        (self.went_off.clear if on else self.went_off.set)()

    def command(self, levels: Sequence[float], sequence: int) -> None:
        """As a device does."""
        super().command(levels, sequence)
        self._left -= 1
        if self._left == 0:
            self.has_enough.set()


@contextmanager
def in_thread(make: Callable[[], AbstractAsyncContextManager[T]]) -> Iterator[T]:
    """An asynchronous context in an event loop of its own, in a thread."""
    ready: SimpleQueue[tuple[T, asyncio.AbstractEventLoop, asyncio.Event]] = SimpleQueue()

    async def run() -> None:
        stop = asyncio.Event()
        async with make() as made:
            ready.put((made, asyncio.get_running_loop(), stop))
            await stop.wait()

    thread = threading.Thread(target=asyncio.run, args=(run(),))
    thread.start()
    made, loop, stop = ready.get(timeout=20.0)
    try:
        yield made
    finally:
        loop.call_soon_threadsafe(stop.set)
        thread.join(20.0)
        assert not thread.is_alive()


@contextmanager
def instrument_at(device: JournalledDevice, name: str, where: str = "127.0.0.1:0") -> Iterator[str]:
    """A sound instrument in front of `device`; where it is."""
    with in_thread(lambda: served(device, Wires(scpi=where, instrument=name))) as ends:
        yield ends.split()[1]


Respond = Callable[[str, str], bytes]
"""Maps a line and its sound answer ("" for none) to what is sent."""


def whole(said: str) -> bytes:
    """What a sound instrument sends."""
    return f"{said}\n".encode() if said else b""


@contextmanager
def spoilt_instrument(instrument: Answering, respond: Respond) -> Iterator[str]:
    """An instrument that sends what `respond` makes of its answers; its address."""

    async def client(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while line := (await reader.readline()).decode().strip():
            writer.write(respond(line, await instrument.answer(line)))
        writer.close()

    @asynccontextmanager
    async def serve() -> AsyncIterator[str]:
        server = await asyncio.start_server(client, "127.0.0.1", 0)
        try:
            yield f"127.0.0.1:{server.sockets[0].getsockname()[1]}"
        finally:
            server.close()

    with in_thread(serve) as address:
        yield address


def driver_at(
    place: Place | str, table: str = "keithley-2450", compliance_V: float = 20.0, setup_timeout_s: float = 5.0
) -> ScpiDriver:
    """A driver of the bundled device, closed; `place` may be HOST:PORT."""
    there = tcp_place(place) if isinstance(place, str) else place
    settings = SourceSettings(
        compliance_V=compliance_V, low_A=LOW_A, high_A=HIGH_A, safe_A=LOW_A, nplc=0.02, current_range_A=0.01
    )
    return ScpiDriver(Instrument(load_table(table, Path()), there, setup_timeout_s), settings, VO2)


def commanded(device: JournalledDevice) -> list[float]:
    """Levels that came into force at the device [mA]."""
    return [entry.values[0] for entry in device.journal() if entry.event == "command"]
