"""The server of the page: loopback only, a thread a connection, bounded in what a viewer can make it hold."""

from __future__ import annotations

import errno
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, TypeVar

from rtctl.border.errors import InputError
from rtctl.live_page.served.access import Access
from rtctl.live_page.served.history import History
from rtctl.live_page.served.requests import PageRequest

HOST = "127.0.0.1"
DEFAULT_PORT = 8787
MOST_VIEWERS = 16
SEND_BUFFER = 1 << 18
"""Bytes that the kernel holds for a viewer that does not take them; beyond that its thread waits, and it skips."""

SHUTDOWN_POLL_S = 0.1
"""How often the server looks whether it is to end [s]."""

Bound = TypeVar("Bound", bound="LoopbackServer")


class LoopbackServer(ThreadingHTTPServer):
    """A server of this machine for this machine."""

    daemon_threads = True

    def __init__(self, access: Access, port: int, requests: type[BaseHTTPRequestHandler]) -> None:
        """Bind to a port, 0: a free one. Raises OSError where it is taken."""
        self.access = access
        self.ended = threading.Event()
        super().__init__((HOST, port), requests)

    @property
    def address(self) -> str:
        """The address of the page, token included."""
        return f"http://{HOST}:{self.server_port}/{self.access.token}/"

    def get_request(self) -> tuple[socket.socket, Any]:
        """Take a connection, with a bounded buffer."""
        connection, peer = super().get_request()
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        return connection, peer

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say what went wrong in a line; a browser that went away is nothing to tell."""
        error = sys.exception()
        if not isinstance(error, ConnectionError | TimeoutError):
            print(f"rtctl watch: a request failed: {type(error).__name__}: {error}", file=sys.stderr)


class PageServer(LoopbackServer):
    """Serves the page of one watched folder."""

    def __init__(self, folder: Path, access: Access, port: int) -> None:
        """Bind to a port of this machine, 0: a free one. Raises OSError where it is taken."""
        self.folder = folder
        self.history = History(folder)
        self.seats = threading.BoundedSemaphore(MOST_VIEWERS)
        super().__init__(access, port, PageRequest)


@contextmanager
def page_served(folder: Path, access: Access, port: int | None) -> Iterator[PageServer]:
    """Serve the page of `folder` in threads of this process inside the block.

    Args:
        folder: the watched folder.
        access: what a request must show.
        port: of this machine; 0: a free one; None: the usual one, or a free one where that is taken.

    Raises:
        InputError: the port cannot be used.
    """
    with serving(bound(lambda number: PageServer(folder, access, number), port)) as server:
        yield server


@contextmanager
def serving(server: Bound) -> Iterator[Bound]:
    """Serve in threads of this process inside the block."""
    thread = threading.Thread(target=server.serve_forever, args=(SHUTDOWN_POLL_S,), name="page", daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.ended.set()
        server.shutdown()
        server.server_close()
        thread.join()


def bound(made: Callable[[int], Bound], port: int | None) -> Bound:
    """Return `made(port)`; where `port` is None, on the usual one or on a free one. Raises InputError."""
    try:
        return made(DEFAULT_PORT if port is None else port)
    except (OSError, OverflowError) as error:
        if port is None:
            return made(0)
        if isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
            raise InputError(
                f"--port {port}: is taken by another program; choose another one, or 0 for a free one"
            ) from None
        raise InputError(
            f"--port {port}: cannot be used: {getattr(error, 'strerror', None) or error}"
        ) from None
