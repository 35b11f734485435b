"""The way from outside into a run's parameter channel: a datagram socket `DIR/control.sock`, one change a datagram.

A helper thread waits on it, so the loop never does. A change is JSON, {"name": "setpoint", "value": 30.0}; the answer,
if the sender is bound to a name, is "ok" or what is wrong with it. What the loop makes of it is among the run's events.
"""

from __future__ import annotations

import json
import os
import socket
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rtctl.border.errors import InputError, RunError
from rtctl.loop.live_parameters import ParameterChannel

NAME = "control.sock"
LARGEST = 4096
ANSWER_WITHIN_S = 2.0


@contextmanager
def listening(folder: Path, changes: ParameterChannel) -> Iterator[None]:
    """Take changes for the run in `folder` inside the block. A path too long for a socket: none, in silence."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / NAME
    path.unlink(missing_ok=True)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as server:
        try:
            server.bind(_short(path))
        except OSError:
            yield
            return
        os.chmod(path, 0o600)
        thread = threading.Thread(target=_listen, args=(server, changes), name="control", daemon=True)
        thread.start()
        try:
            yield
        finally:
            path.unlink(missing_ok=True)
            server.shutdown(socket.SHUT_RDWR)
            thread.join()
            with suppress(OSError):  # a run that never began leaves no empty folder
                folder.rmdir()


def send(folder: Path, name: str, value: float) -> None:
    """Ask the run in `folder` for a change. Raises InputError where nothing runs there, RunError on no answer."""
    path = folder / NAME
    with (
        tempfile.TemporaryDirectory(prefix="rtctl-") as place,
        socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as client,
    ):
        client.bind(str(Path(place) / "answer"))
        client.settimeout(ANSWER_WITHIN_S)
        try:
            client.sendto(json.dumps({"name": name, "value": value}).encode(), _short(path))
        except OSError:
            raise InputError(f"{folder}: no run is under way here (no answer at {NAME})") from None
        try:
            answer = client.recv(LARGEST).decode()
        except TimeoutError:
            raise RunError(f"{folder}: the run has not answered within {ANSWER_WITHIN_S:g} s") from None
    if answer != "ok":
        raise InputError(answer)


def _listen(server: socket.socket, changes: ParameterChannel) -> None:
    while True:
        try:
            datagram, sender = server.recvfrom(LARGEST)
        except OSError:
            return
        if not datagram:
            return  # shut down
        answer = _offer(datagram, changes)
        if sender:
            with suppress(OSError):
                server.sendto(answer.encode(), sender)


def _offer(datagram: bytes, changes: ParameterChannel) -> str:
    try:
        content = json.loads(datagram)
        name, value = str(content["name"]), float(content["value"])
    except (ValueError, KeyError, TypeError):
        return 'a change is {"name": ..., "value": ...}'
    try:
        changes.offer(name, value)
    except InputError as error:
        return str(error)
    return "ok"


def _short(path: Path) -> str:
    """A socket's path has room for some hundred bytes: relative, where that is shorter."""
    return min(str(path), os.path.relpath(path), key=len)
