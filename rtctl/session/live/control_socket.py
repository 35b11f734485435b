"""Changes of a running loop from outside: a datagram socket `DIR/control.sock`, one change a datagram.

A helper thread waits on the socket, so the loop never does. A change is JSON, {"name": "setpoint", "value": 30.0}; the
answer, if the sender's socket has a name, is "ok" or what is wrong. With "report": true an "ok" is followed by a line
of JSON: {"before": the parameter's value, "remark": what to know of the change}. {"name": "stop"} ends the run at its
safe levels; {"name": "parameters"} is answered by a line of JSON with their values; {"name": "model", "value": 1} lets
the model `retuned-1.toml` take over, and is answered once that is prepared, seconds later, in a thread of its own. The
loop notes what it does among the run's events.
"""

from __future__ import annotations

import json
import math
import os
import socket
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.border.errors import InputError, RunError, nearest
from rtctl.border.mechanisms import plain_unit
from rtctl.border.units.quantities import parse_quantity
from rtctl.loop.live_parameters import (
    MODEL,
    SETPOINT,
    STOP,
    Change,
    ParameterChannel,
    units_of_parameters,
)
from rtctl.output.readable_units import readable
from rtctl.recording.layout import read_header
from rtctl.recording.tail import Tail
from rtctl.scenario.schema import checked_scenario
from rtctl.session.run_folder import SIGNALS, scenario_tables

NAME = "control.sock"
LARGEST_DATAGRAM = 1 << 16
"""Largest request and answer [bytes]: names and values of some hundred parameters."""
ANSWER_WITHIN_S = 2.0
COMPILED_WITHIN_S = 60.0
"""The same of a served device, which may have to compile another equation first [s]."""
PREPARED_WITHIN_S = 120.0
"""The same of another model, which has to be compiled and to follow the run first [s]."""
PARAMETERS = "parameters"
"""Name of the question for the values of all parameters; and key of a recording's metadata for their units as JSON,
where it is the account of a served device and not a run of a scenario."""
CHANGES = "changes"
"""Key of the metadata of a recording that nothing but stop can change; its value says why."""
FAULT = "fault."
"""What the name of a fault begins with, which a served device is asked to have once; its value is how long [s]."""
PLAN = "plan"
"""Value of the setpoint that goes back to the scenario's `[reference]`."""


@contextmanager
def listening(folder: Path, changes: ParameterChannel) -> Iterator[None]:
    """Take changes for the run in `folder` inside the block; none, in silence, if the path is too long for a socket."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / NAME
    path.unlink(missing_ok=True)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as server:
        try:
            server.bind(_shorter(path))
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
            with suppress(OSError):  # a run that never started leaves no empty folder
                folder.rmdir()


def is_listened_to(folder: Path) -> bool | None:
    """Return whether a run takes changes in `folder`; None: there is no socket. That of a killed run stays behind."""
    path = folder / NAME
    if not path.is_socket():
        return None
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as client:
        try:
            client.connect(_shorter(path))
        except ConnectionRefusedError:
            return False
        except OSError:  # it has just gone, or is another user's
            return None
    return True


def read_change(folder: Path, text: str) -> Change:
    """Read a change as a person writes it, `setpoint=30 um`, in the units of the run in `folder`.

    Args:
        folder: the folder into which the run records.
        text: name and value; a number without a unit is in that of the parameter.

    Raises:
        InputError: no run is under way in `folder`, or `text` names no parameter, or its value is not finite.
    """
    name, equals, written = (part.strip() for part in text.partition("="))
    if not equals or not written:
        raise InputError(f"{text}: expected NAME=VALUE, such as setpoint=30")
    if name == SETPOINT and written == PLAN:
        return Change(name, math.nan)
    units = parameter_units(folder)
    if why := _metadata(folder).get(CHANGES):
        raise InputError(f"{name}: {why}")
    if name not in units:
        raise InputError(f'"{name}" cannot be changed while the loop runs{nearest(name, units)}')
    try:
        value = float(written)
    except ValueError:
        try:
            value = parse_quantity(written, units[name])
        except ValueError as error:
            raise InputError(f"{name}: {error}") from None
    if not math.isfinite(value):
        raise InputError(f"{name} = {written}: a finite number is needed")
    return Change(name, value)


class Taken(NamedTuple):
    """A change that a run has taken."""

    name: str
    before: float | None
    """Value before it, in `unit`; None: not known. NaN of the set-point of the plan."""
    value: float
    """New value in `unit`; NaN: the set-point of the plan again."""
    unit: str
    remark: str
    """What to know of it, such as the margins that new gains leave."""

    def in_words(self) -> str:
        """Return `setpoint: 20 um -> 30 um from the next step on; REMARK`, of a fault `fault.stall: 50 ms; REMARK`."""

        def told(value: float | None) -> str:
            return (
                "not known" if value is None else "the plan" if value != value else readable(value, self.unit)
            )

        remark = f"; {self.remark}" if self.remark else ""
        if self.name.startswith(FAULT):
            return f"{self.name}: {readable(self.value, self.unit)}{remark}"
        return f"{self.name}: {told(self.before)} -> {told(self.value)} from the next step on{remark}"


def send(folder: Path, name: str, value: float) -> Taken:
    """Ask the run in `folder` for a change; return what it was from and to.

    Args:
        folder: the folder into which the run records.
        name: `setpoint`, or a gain as in the scenario.
        value: the new value, in the unit of the run; NaN: the set-point of the plan again.

    Raises:
        InputError: no run is under way in `folder`, or it refuses the change.
        RunError: the run does not answer in time.
    """
    unit = plain_unit(parameter_units(folder).get(name, ""))
    before = _setpoint_in_force(folder) if name == SETPOINT else None
    within_s = COMPILED_WITHIN_S if PARAMETERS in _metadata(folder) else ANSWER_WITHIN_S
    known = _asked(folder, {"name": name, "value": value, "report": True}, within_s)
    return Taken(name, known.get("before", before), value, unit, str(known.get("remark", "")))


def stop(folder: Path) -> None:
    """Ask the run in `folder` to end at its safe levels. Raises as `send`."""
    _asked(folder, {"name": STOP})


def change_model(folder: Path, number: int) -> str:
    """Let another model of the run in `folder` take over; return how its controller was tuned. Raises as `send`."""
    known = _asked(folder, {"name": MODEL, "value": number, "report": True}, PREPARED_WITHIN_S)
    return str(known.get("remark", ""))


def parameters(folder: Path) -> dict[str, float]:
    """Return the values of the controller's parameters of the run in `folder`, each in its unit. Raises as `send`."""
    return {str(name): float(value) for name, value in _asked(folder, {"name": PARAMETERS}).items()}


def _asked(folder: Path, request: dict[str, Any], within_s: float = ANSWER_WITHIN_S) -> dict[str, Any]:
    """Send a request to the run in `folder`; return what follows its "ok". Raises InputError, RunError."""
    path = folder / NAME
    with (
        tempfile.TemporaryDirectory(prefix="rtctl-") as place,
        socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as client,
    ):
        client.bind(str(Path(place) / "answer"))
        client.settimeout(within_s)
        try:
            client.sendto(json.dumps(request).encode(), _shorter(path))
        except OSError:
            raise InputError(f"{folder}: no run is under way here (no answer at {NAME})") from None
        try:
            answer = client.recv(LARGEST_DATAGRAM).decode()
        except TimeoutError:
            raise RunError(f"{folder}: the run has not answered within {within_s:g} s") from None
    said, _, report = answer.partition("\n")
    if said != "ok":
        raise InputError(answer)
    found: dict[str, Any] = json.loads(report) if report else {}
    return found


def _setpoint_in_force(folder: Path) -> float | None:
    """Return the set-point of the newest sample of a run; None before the first one."""
    try:
        tail = Tail(folder / SIGNALS)
    except (OSError, InputError):
        return None
    try:
        rows = tail.new_rows()["setpoint"]
        return float(rows[-1]) if len(rows) else None
    finally:
        tail.close()


def parameter_units(folder: Path) -> dict[str, str]:
    """Return the unit of each parameter that the run in `folder` can change. Raises InputError."""
    metadata = _metadata(folder)
    if CHANGES in metadata:
        return {}
    if PARAMETERS in metadata:
        units: dict[str, str] = json.loads(metadata[PARAMETERS])
        return units
    scenario = checked_scenario(scenario_tables(metadata, folder / SIGNALS), str(folder / SIGNALS))
    return units_of_parameters(scenario.profile, is_played=scenario.reference is None)


def _metadata(folder: Path) -> dict[str, str]:
    """Return what the recording in `folder` says of itself. Raises InputError where there is none."""
    path = folder / SIGNALS
    if not path.is_file():
        raise InputError(f"{folder}: no run is under way here ({SIGNALS} is missing)")
    return read_header(path).metadata


def _listen(server: socket.socket, changes: ParameterChannel) -> None:
    """Offer each datagram to `changes` and answer it, until the socket is shut down."""
    while True:
        try:
            datagram, sender = server.recvfrom(LARGEST_DATAGRAM)
        except OSError:
            return
        if not datagram:
            return  # shut down
        if _wanted(datagram) == MODEL:  # takes seconds: a stop must not wait for it
            threading.Thread(
                target=_answer, args=(server, datagram, sender, changes), name="model", daemon=True
            ).start()
        else:
            _answer(server, datagram, sender, changes)


def _answer(server: socket.socket, datagram: bytes, sender: str, changes: ParameterChannel) -> None:
    answer = _offer(datagram, changes)
    if sender:
        with suppress(OSError):
            server.sendto(answer.encode(), sender)


def _wanted(datagram: bytes) -> str:
    """Return the name of the change that a datagram asks for, "" where it is none."""
    with suppress(ValueError, AttributeError):
        return str(json.loads(datagram).get("name", ""))
    return ""


def _offer(datagram: bytes, changes: ParameterChannel) -> str:
    """Offer one change; return "ok", or what is wrong with it."""
    try:
        content = json.loads(datagram)
        if content["name"] == STOP:
            changes.stop()
            return "ok"
        if content["name"] == PARAMETERS:
            return f"ok\n{json.dumps(dict(changes.parameters()))}"
        name, value, report = str(content["name"]), float(content["value"]), bool(content.get("report"))
    except (ValueError, KeyError, TypeError, AttributeError):
        return 'a change is {"name": ..., "value": ...}'
    known = {"before": before} if (before := changes.parameters().get(name)) is not None else {}
    try:
        remark = changes.offer_model(int(value)) if name == MODEL else changes.offer(name, value)
    except InputError as error:
        return str(error)
    return f"ok\n{json.dumps(known | {'remark': remark})}" if report else "ok"


def _shorter(path: Path) -> str:
    """Return `path`, relative if that is shorter: a socket's path has room for some hundred bytes."""
    return min(str(path), os.path.relpath(path), key=len)
