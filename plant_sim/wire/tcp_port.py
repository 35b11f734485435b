"""A TCP port of a served device, whose faults break all connections and refuse new ones for a while."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager

from plant_sim.wire.faulty_wire import FaultyWire


class Refused(asyncio.Protocol):
    """A connection that is broken at once."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """See `asyncio.Protocol`."""
        assert isinstance(transport, asyncio.Transport)
        transport.abort()


@asynccontextmanager
async def listening(
    host: str,
    port: int,
    connected: Callable[[], asyncio.Protocol],
    transports: Callable[[], Iterable[asyncio.Transport]],
    faults: FaultyWire | None,
) -> AsyncIterator[int]:
    """Listen on `host:port` while the block runs; yields the port (0 asks for a free one). Raises OSError.

    Args:
        host: Address of this machine.
        port: Its port.
        connected: Makes the protocol of a connection.
        transports: Returns those of the connections that are open.
        faults: What goes wrong on the line.
    """
    loop = asyncio.get_running_loop()
    refused_until_s = 0.0

    def accepted() -> asyncio.Protocol:
        return Refused() if loop.time() < refused_until_s else connected()

    def hang_up(duration_s: float = 0.0) -> None:
        nonlocal refused_until_s
        refused_until_s = loop.time() + duration_s
        for transport in list(transports()):
            transport.abort()

    if faults is not None:
        faults.hang_up.append(hang_up)
    server = await loop.create_server(accepted, host, port)
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        server.close()
        hang_up()
        await server.wait_closed()
