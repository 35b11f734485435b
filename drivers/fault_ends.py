"""Both ends of a line with faults, as file descriptors: a TCP connection or a pty that can break and be reopened."""

from __future__ import annotations

import os
import select
import socket
import tty
from contextlib import suppress
from pathlib import Path
from typing import Protocol


class Line(Protocol):
    """A line with two ends as file descriptors; -1: there is none at present."""

    where: str
    """Address or path that the host connects to."""
    listener: int
    host: int
    device: int

    def connect(self) -> None:
        """Accept or reopen what became ready. Raises OSError."""
        ...

    def hang_up(self) -> None:
        """Break the line; both sides notice, as far as their kind of line tells."""
        ...

    def close(self) -> None:
        """Hang up for good."""
        ...


class TcpLine:
    """A line over TCP: a listener on a free port, whose every connection makes one to the device."""

    def __init__(self, target: str) -> None:
        host, _, port = target.rpartition(":")
        self._target = (host.strip("[]"), int(port))
        self._server = socket.create_server(("127.0.0.1", 0))
        self.listener = self._server.fileno()
        self.where = f"127.0.0.1:{self._server.getsockname()[1]}"
        self.host = self.device = -1

    def connect(self) -> None:
        """Accept a host and connect to the device; a new host replaces the old one."""
        if not select.select([self.listener], [], [], 0.0)[0]:
            return
        client, _ = self._server.accept()
        self.hang_up()
        try:
            device = socket.create_connection(self._target, timeout=1.0)
        except OSError:
            client.close()
            return
        for end in (client, device):
            end.setblocking(False)  # a descriptor of an old connection may be a new one's when its turn comes
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.host, self.device = client.detach(), device.detach()

    def hang_up(self) -> None:
        """Close both connections."""
        for end in (self.host, self.device):
            if end >= 0:
                os.close(end)
        self.host = self.device = -1

    def close(self) -> None:
        """Listen no more."""
        self.hang_up()
        self._server.close()
        self.listener = -1


class PtyLine:
    """A line over a pty for the host, with a link at `where`; the device's port stays open."""

    def __init__(self, target: str, link: str) -> None:
        self.where, self.listener, self.host = link, -1, -1
        self.device = os.open(target, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self.device)
        self._slave = -1
        self.connect()

    def connect(self) -> None:
        """Make a new pty under the same link, unless there is one."""
        if self.host < 0:
            self.host, self._slave = os.openpty()
            tty.setraw(self._slave)
            os.set_blocking(self.host, False)
            partial = Path(f"{self.where}.new")
            partial.symlink_to(os.ttyname(self._slave))
            partial.replace(self.where)

    def hang_up(self) -> None:
        """Close the pty: the host reads an error, and the link is gone until the line is reopened."""
        if self.host >= 0:
            with suppress(OSError):
                Path(self.where).unlink()
            os.close(self._slave)
            os.close(self.host)
        self.host = -1

    def close(self) -> None:
        """Close the pty and the device's port."""
        self.hang_up()
        if self.device >= 0:
            os.close(self.device)
        self.device = -1
