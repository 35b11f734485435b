"""A page that is served elsewhere, shown under an address of this machine: requests go there, answers come back.

For a loop on another machine behind a tunnel, or for a second viewer with an address of its own that only reads.
"""

from __future__ import annotations

import http.client
from collections.abc import Iterator
from contextlib import contextmanager
from http import HTTPStatus
from typing import NamedTuple
from urllib.parse import urlsplit

from rtctl.border.errors import InputError
from rtctl.live_page.served.access import Access
from rtctl.live_page.served.control import LARGEST_REQUEST
from rtctl.live_page.served.requests import PATIENCE_S, PageRequest
from rtctl.live_page.served.server import LoopbackServer, bound, serving

FORWARDED = ("Content-Type", "Content-Length", "Cache-Control", "Content-Security-Policy", "Referrer-Policy",
             "X-Content-Type-Options")  # fmt: skip
CHUNK = 1 << 16


class Upstream(NamedTuple):
    """The page that is served elsewhere."""

    host: str
    port: int
    token: str


def upstream_of(address: str) -> Upstream:
    """Return what `http://HOST:PORT/TOKEN/` names, after asking it. Raises InputError."""
    try:
        url = urlsplit(address)
        host, port, token = url.hostname or "", url.port or 80, url.path.strip("/")
    except ValueError as error:
        raise InputError(f"--live {address}: {error}") from None
    if url.scheme != "http" or not host or not token:
        raise InputError(
            f"--live {address}: the whole address is needed that rtctl watch printed: http://HOST:PORT/TOKEN/"
        )
    upstream = Upstream(host, port, token)
    try:
        connection = http.client.HTTPConnection(host, port, timeout=PATIENCE_S)
        connection.request("GET", f"/{token}/runs")
        answer = connection.getresponse()
        text = answer.read().decode(errors="replace").strip()
        connection.close()
    except (OSError, http.client.HTTPException) as error:
        if isinstance(error, ConnectionRefusedError):
            what = "nothing listens at this port; start rtctl watch there, or open the tunnel"
        else:
            what = getattr(error, "strerror", None) or str(error) or "it does not speak HTTP"
        raise InputError(f"--live {address}: no page is served there: {what}") from None
    if answer.status != HTTPStatus.OK:
        raise InputError(f"--live {address}: {text}")
    return upstream


class RelayServer(LoopbackServer):
    """Serves a page that is served elsewhere."""

    def __init__(self, upstream: Upstream, access: Access, port: int) -> None:
        """Bind to a port of this machine, 0: a free one. Raises OSError where it is taken."""
        self.upstream = upstream
        super().__init__(access, port, RelayRequest)


class RelayRequest(PageRequest):
    """Forwards one request."""

    server: RelayServer  # type: ignore[assignment]

    def do_GET(self) -> None:
        """Forward a request that reads."""
        if self._allowed() is not None:
            self._forward(b"")

    def do_POST(self) -> None:
        """Forward a request that changes the run."""
        if self._allowed() is None:
            return
        refusal = self.server.access.refuse_change(self.headers)
        length = self.headers.get("Content-Length", "")
        if refusal is not None:
            self._say(*refusal)
        elif not length.isdecimal() or int(length) > LARGEST_REQUEST:
            self._say(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"a change has at most {LARGEST_REQUEST} bytes")
        else:
            self._forward(self.rfile.read(int(length)))

    def _forward(self, body: bytes) -> None:
        upstream = self.server.upstream
        connection = http.client.HTTPConnection(upstream.host, upstream.port, timeout=PATIENCE_S)
        target = self.path.partition("/")[2].partition("/")[2]
        names = ("Last-Event-ID", "Content-Type")
        headers = {name: self.headers[name] for name in names if name in self.headers}
        try:
            connection.request(self.command, f"/{upstream.token}/{target}", body or None, headers)
            answer = connection.getresponse()
        except (OSError, http.client.HTTPException) as error:
            connection.close()
            self._say(
                HTTPStatus.BAD_GATEWAY,
                f"the page at {upstream.host}:{upstream.port} does not answer: {error}",
            )
            return
        try:
            self.close_connection = True
            self.send_response(answer.status)
            for name in FORWARDED:
                if (value := answer.headers.get(name)) is not None:
                    self.send_header(name, value)
            self.send_header("Connection", "close")
            self.end_headers()
            while not self.server.ended.is_set() and (chunk := answer.read1(CHUNK)):
                self.wfile.write(chunk)
        finally:
            connection.close()


@contextmanager
def page_relayed(upstream: Upstream, access: Access, port: int | None) -> Iterator[RelayServer]:
    """Serve the page of `upstream` inside the block; other arguments and errors as `page_served`."""
    with serving(bound(lambda number: RelayServer(upstream, access, number), port)) as server:
        yield server
