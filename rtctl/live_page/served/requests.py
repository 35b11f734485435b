"""One request of a browser: the page and its files, the stream, ranges of the recording, changes of the run."""

from __future__ import annotations

import json
import math
import threading
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import parse_qs, urlsplit

from rtctl.border.errors import InputError, RtctlError
from rtctl.evaluation.metrics import finite
from rtctl.live_page.recorded.places import newest_of, places_in
from rtctl.live_page.served.access import Access
from rtctl.live_page.served.control import LARGEST_REQUEST, change, changeable
from rtctl.live_page.served.history import History
from rtctl.live_page.served.stream import FRAMES_A_SECOND, Stream

PAGE = Path(__file__).parent.parent / "page"
KINDS = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".txt": "text/plain"}
HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
PATIENCE_S = 20.0
"""A browser that takes nothing for so long is taken as gone."""


class Served(Protocol):
    """What a request needs of its server."""

    folder: Path
    """The watched folder."""
    access: Access
    history: History
    seats: threading.BoundedSemaphore
    """One for each viewer that may be there."""
    ended: threading.Event


class PageRequest(BaseHTTPRequestHandler):
    """Answers one connection; paths are /TOKEN/WHAT?QUERY."""

    protocol_version = "HTTP/1.1"
    timeout = PATIENCE_S
    server: Served  # type: ignore[assignment]

    def do_GET(self) -> None:
        """Answer a request that reads."""
        what = self._allowed()
        if what is None:
            return
        query = {name: values[-1] for name, values in parse_qs(urlsplit(self.path).query).items()}
        try:
            if what == "stream":
                self._stream(query)
            elif what == "runs":
                places = places_in(self.server.folder)
                newest = newest_of(places)
                names = [place.name for place in places]
                self._json({"runs": names, "newest": None if newest is None else newest.name})
            elif what == "history":
                self._json(self._history(query))
            elif what == "parameters":
                self._json(changeable(self.server.folder, query.get("run", "")))
            else:
                self._file(what or "index.html")
        except RtctlError as error:
            self._say(HTTPStatus.CONFLICT, str(error))

    def do_POST(self) -> None:
        """Answer a request that changes the run."""
        what = self._allowed()
        if what is None:
            return
        refusal = self.server.access.refuse_change(self.headers)
        length = self.headers.get("Content-Length", "")
        if refusal is not None:
            self._say(*refusal)
        elif what != "control":
            self._say(HTTPStatus.NOT_FOUND, f"{what}: nothing here takes a change; it is control that does")
        elif not length.isdecimal() or int(length) > LARGEST_REQUEST:
            self._say(
                HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
                f"a change has at most {LARGEST_REQUEST} bytes, and says how many",
            )
        else:
            try:
                request = json.loads(self.rfile.read(int(length)))
                self._json({"said": change(self.server.folder, request)})
            except (RtctlError, UnicodeDecodeError, json.JSONDecodeError) as error:
                self._say(HTTPStatus.CONFLICT, str(error))

    def _allowed(self) -> str | None:
        """Return what is asked for, below the token; None: it was refused."""
        token, _, what = urlsplit(self.path).path.removeprefix("/").partition("/")
        refusal = self.server.access.refuse_reading(token, self.headers)
        if refusal is None:
            return what
        self._say(*refusal)
        return None

    def _history(self, query: Mapping[str, str]) -> dict[str, Any]:
        try:
            from_s, to_s = float(query.get("from", "-inf")), float(query.get("to", "inf"))
            bins = int(query.get("points", "1000"))
        except ValueError:
            raise InputError("from and to are times in s, points is a whole number") from None
        if math.isnan(from_s) or math.isnan(to_s):
            raise InputError("from and to are times in s, not NaN")
        return self.server.history.range(query.get("run", ""), from_s, to_s, bins)

    def _stream(self, query: Mapping[str, str]) -> None:
        """Send events until the browser goes away or the server ends."""
        if not self.server.seats.acquire(blocking=False):
            self._say(
                HTTPStatus.SERVICE_UNAVAILABLE,
                "too many viewers at once; close a page that is open elsewhere",
            )
            return
        last = self.headers.get("Last-Event-ID") or query.get("last", "")
        stream = Stream(self.server.folder, query.get("run", ""), last)
        try:
            self.close_connection = True
            self._begin(HTTPStatus.OK, "text/event-stream", None)
            self.wfile.write(stream.first())
            while not self.server.ended.wait(1.0 / FRAMES_A_SECOND):
                for event in stream.look():
                    self.wfile.write(event)
        finally:
            stream.close()
            self.server.seats.release()

    def _file(self, name: str) -> None:
        """Send a file of the page."""
        path = PAGE / name
        if (
            path.suffix not in KINDS
            or not path.resolve().is_relative_to(PAGE.resolve())
            or not path.is_file()
        ):
            self._say(HTTPStatus.NOT_FOUND, f"{name}: there is no such page here")
            return
        content = path.read_bytes()
        if name == "index.html":
            content = content.replace(b"{{may_change}}", b"yes" if self.server.access.may_change else b"no")
        self._send(HTTPStatus.OK, KINDS[path.suffix], content)

    def _json(self, content: Any) -> None:
        self._send(HTTPStatus.OK, "application/json", json.dumps(finite(content)).encode())

    def _say(self, status: HTTPStatus, message: str) -> None:
        self.close_connection = True
        self._send(status, "text/plain", f"{message}\n".encode())

    def _send(self, status: HTTPStatus, kind: str, content: bytes) -> None:
        self._begin(status, kind, len(content))
        self.wfile.write(content)

    def _begin(self, status: HTTPStatus, kind: str, length: int | None) -> None:
        self.send_response(status)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        for name, value in HEADERS.items():
            self.send_header(name, value)
        if length is not None:
            self.send_header("Content-Length", str(length))
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()

    def log_message(self, format: str, *args: Any) -> None:
        """Print nothing of a request."""
