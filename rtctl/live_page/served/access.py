"""Who may read the page and change the run: the token in the path, the Host and the Origin of a request.

The token is what a stranger lacks. Host is checked because a foreign web page can make its own name lead to 127.0.0.1
(DNS rebinding), Origin because it can send requests to this server from a browser of this machine.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import os
import secrets
from contextlib import suppress
from email.message import Message
from http import HTTPStatus
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

LOOPBACK = ("127.0.0.1", "localhost", "::1")
KEY_BYTES = 32
TOKEN_BYTES = 16


class Refusal(NamedTuple):
    """Why a request is not answered."""

    status: HTTPStatus
    message: str


class Access(NamedTuple):
    """What a request must show."""

    token: str
    may_change: bool
    """Whether changes of the run are taken at all."""

    def refuse_reading(self, token: str, headers: Message) -> Refusal | None:
        """Return why a request may not read, or None.

        Args:
            token: the first part of its path.
            headers: its headers.
        """
        host = headers.get("Host") or ""
        if _name(f"//{host}") not in LOOPBACK:
            return Refusal(
                HTTPStatus.FORBIDDEN,
                f"this page is for this machine only, under {' or '.join(LOOPBACK[:2])}, not under {host!r}; from "
                "another one use a tunnel: ssh -L PORT:localhost:PORT",
            )
        origin = headers.get("Origin")
        if origin is not None and origin != f"http://{host}":
            return Refusal(HTTPStatus.FORBIDDEN, f"a page of {origin} may not use this one")
        if not hmac.compare_digest(token.encode(), self.token.encode()):
            return Refusal(
                HTTPStatus.FORBIDDEN,
                "the token in the address is missing or wrong: open the whole address that rtctl watch printed",
            )
        return None

    def refuse_change(self, headers: Message) -> Refusal | None:
        """Return why a request that may read may not change the run, or None."""
        if not self.may_change:
            return Refusal(
                HTTPStatus.FORBIDDEN,
                "this page only shows; start rtctl watch with --control to change the run",
            )
        if headers.get("Content-Type", "").partition(";")[0].strip() != "application/json":
            return Refusal(
                HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "a change is sent as Content-Type: application/json"
            )
        return None


def token_of(folder: Path) -> str:
    """Return the token of a watched folder: random, and the same when the page is served again.

    It is derived from a random key that only this user can read, `rtctl/watch.key` below XDG_STATE_HOME, so that an
    open page goes on after the server was started again. Without a place for the key, the token is new each time.
    """
    try:
        state = Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state")
        key = _key(state / "rtctl" / "watch.key")
    except (OSError, RuntimeError):  # RuntimeError: there is no home
        return secrets.token_urlsafe(TOKEN_BYTES)
    digest = hmac.new(key, os.fsencode(folder.resolve()), hashlib.sha256).digest()
    return base64.urlsafe_b64encode(digest[:TOKEN_BYTES]).rstrip(b"=").decode()


def _key(path: Path) -> bytes:
    """Return the key in a file; make it, readable by its owner only, where there is none. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with suppress(FileExistsError):
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(file, "wb") as stream:
            stream.write(secrets.token_bytes(KEY_BYTES))
    key = path.read_bytes()
    if len(key) != KEY_BYTES or path.stat().st_mode & 0o077:
        raise OSError(f"{path}: not a key that only its owner can read")
    return key


def _name(url: str) -> str:
    try:
        return urlsplit(url).hostname or ""
    except ValueError:
        return ""
