"""The rows of a run as UDP packets for PlotJuggler: a JSON array of records, about 30 packets a second.

Each record has "timestamp", in seconds that never go back, also when another run begins (PlotJuggler would have to be
started again), and the signals by name; a value that is no number is left out.
Reference: PlotJuggler's UDP server with the JSON parser, field "timestamp" as time stamp.
"""

from __future__ import annotations

import json
import math
import socket
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from rtctl.border.errors import InputError
from rtctl.live_page.shown.description import Description
from rtctl.live_page.streams.follower import Follower

LARGEST_PACKET = 8192
"""Bytes of a packet at most; a record that is longer by itself is sent alone."""
MOST_ROWS = 4096
"""Rows of one look at most: the newest ones."""


class PlotJugglerSender:
    """Follows the newest run of a folder, from its newest row on, and sends what is new."""

    def __init__(self, folder: Path, address: str) -> None:
        """Prepare to send. Raises InputError where `address` is not HOST:PORT or has no such host."""
        self._follower = Follower(folder)
        self._is_first = True
        self._begin_s, self._newest_s = 0.0, -math.inf
        self._target = udp_target(address)
        self._socket = socket.socket(self._target[0], socket.SOCK_DGRAM)

    def look(self) -> int:
        """Send the rows since the last look; return how many."""
        follower = self._follower
        begun, description = follower.look(), follower.description
        if description is None:
            return 0
        count = description.rows.count()
        if begun:
            self._begin(description, count)
        first = max(follower.taken, count - MOST_ROWS)
        follower.taken = count
        if first >= count:
            return 0
        for packet in packets(list(self._records(description, first, count))):
            with suppress(OSError):  # nobody listens there at this moment
                self._socket.sendto(packet, self._target[1])
        return count - first

    def close(self) -> None:
        """Close the socket and the files."""
        self._follower.close()
        self._socket.close()

    def _begin(self, description: Description, count: int) -> None:
        """Turn to another recording, whose time goes on where the last one ended."""
        self._follower.taken = count - 1 if self._is_first else 0
        self._is_first = False
        first_s = description.time_s(self._follower.taken)
        self._begin_s = max(0.0, self._newest_s + description.period_s - first_s)

    def _records(self, description: Description, first: int, last: int) -> Iterator[dict[str, Any]]:
        names = [signal.name for signal in description.shown.signals]
        table = description.rows.read(first, last)
        samples = table["index"].tolist() if "index" in table else list(range(first, last))
        for sample, row in zip(samples, description.shown.matrix(table).T.tolist(), strict=True):
            self._newest_s = self._begin_s + description.period_s * sample
            values = {name: value for name, value in zip(names, row, strict=True) if math.isfinite(value)}
            yield {"timestamp": round(self._newest_s, 9), **values}


def packets(records: list[dict[str, Any]]) -> Iterator[bytes]:
    """Yield records as arrays of JSON of at most `LARGEST_PACKET` bytes."""
    texts: list[str] = []
    size = 0
    for record in records:
        text = json.dumps(record)
        if texts and size + len(text) + 2 > LARGEST_PACKET:
            yield f"[{','.join(texts)}]".encode()
            texts, size = [], 0
        texts.append(text)
        size += len(text) + 1
    if texts:
        yield f"[{','.join(texts)}]".encode()


def udp_target(address: str) -> tuple[socket.AddressFamily, Any]:
    """Return family and address of `HOST:PORT`. Raises InputError."""
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise InputError(f"--plotjuggler {address}: HOST:PORT is needed, such as localhost:9870")
    try:
        found = socket.getaddrinfo(host.strip("[]"), int(port), type=socket.SOCK_DGRAM)[0]
    except OSError as error:
        raise InputError(f"--plotjuggler {address}: no such host: {error.strerror or error}") from None
    return found[0], found[4]
