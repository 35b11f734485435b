"""Process variables as caproto has them: numbers with units and an alarm where they are not known; texts.

Imported only where caproto is installed.
"""

from __future__ import annotations

import math
import socket
from collections.abc import Awaitable, Callable
from typing import Any

from caproto import (
    AccessRights,
    AlarmSeverity,
    AlarmStatus,
    ChannelAlarm,
    ChannelChar,
    ChannelDouble,
    SkipWrite,
)
from caproto.asyncio.server import Context

Ask = Callable[[float], Awaitable[None]]
"""Asks the run for a value; raises where it refuses."""


class Number(ChannelDouble):  # type: ignore[misc] # caproto has no types
    """A number that clients can read; with `ask` they can also ask the run for another value."""

    def __init__(self, unit: str, digits: int, ask: Ask | None) -> None:
        unknown = ChannelAlarm(status=AlarmStatus.UDF, severity=AlarmSeverity.INVALID_ALARM)
        super().__init__(value=math.nan, units=unit, precision=digits, alarm=unknown)
        self._ask = ask

    def check_access(self, hostname: str, username: str) -> AccessRights:
        """Return what a client may do."""
        return AccessRights.READ if self._ask is None else AccessRights.READ | AccessRights.WRITE

    async def verify_value(self, data: Any) -> Any:
        """Ask the run for the value that a client wants; the variable itself follows the run."""
        assert self._ask is not None
        await self._ask(float(data[0] if isinstance(data, list | tuple) else data))
        raise SkipWrite


class Text(ChannelChar):  # type: ignore[misc] # caproto has no types
    """A text that clients can read."""

    def check_access(self, hostname: str, username: str) -> AccessRights:
        """Return what a client may do."""
        return AccessRights.READ


class Server(Context):  # type: ignore[misc] # caproto has no types
    """caproto's server, except that it leaves no socket open for each port that it finds taken."""

    async def _bind_tcp_sockets_with_consistent_port_number(
        self, make_socket: object
    ) -> tuple[int, dict[str, socket.socket]]:
        port, bound = await super()._bind_tcp_sockets_with_consistent_port_number(_bound_socket)
        return int(port), dict(bound)


async def _bound_socket(address: str, port: int) -> socket.socket:
    """Return a socket bound to a port; raises OSError, with the socket closed, where the port is taken."""
    made = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.setblocking(False)
        made.bind((address, port))
    except OSError:
        made.close()
        raise
    return made


def number(unit: str, digits: int, ask: Ask | None) -> Number:
    """Return a number that is not known yet."""
    return Number(unit, digits, ask)


def text(longest: int) -> Text:
    """Return an empty text of at most so many bytes."""
    return Text(value="", max_length=longest, string_encoding="utf-8")


async def publish(channel: Number | Text, value: float | str) -> None:
    """Give a variable a new value; one that is the same is not sent again. A number that is none is an alarm."""
    if isinstance(value, str):
        shown = value.encode()[: channel.max_length].decode(errors="ignore")
        if channel.value != shown:
            await channel.write(shown, verify_value=False)
        return
    known = math.isfinite(value)
    severity = AlarmSeverity.NO_ALARM if known else AlarmSeverity.INVALID_ALARM
    if channel.severity == severity and (channel.value == value or not known):
        return
    status = AlarmStatus.NO_ALARM if known else AlarmStatus.UDF
    await channel.write(value, verify_value=False, status=status, severity=severity)
