"""A run as EPICS process variables over Channel Access: read by any client, set-point and gains written with --control.

Values are published ten times a second, the usual rate of operator screens. What a client writes goes through the run's
control socket with its checks; a refused value fails the client's put, and PREFIXmessage says why.
"""

from __future__ import annotations

import math
import time
from contextlib import suppress
from pathlib import Path

from rtctl.border.errors import InputError, RunError
from rtctl.live_page.shown.description import Description
from rtctl.live_page.shown.event_log import EventLog
from rtctl.live_page.shown.state import verdict_of
from rtctl.live_page.streams.channel_access import ChannelAccess
from rtctl.live_page.streams.follower import Follower
from rtctl.live_page.streams.process_variables import GAINS, values_of, variables_of
from rtctl.session.live.control_socket import parameters, send

PUBLISH_EVERY_S = 0.1
TEXTS = ("state", "verdict", "fault", "message")
COUNTS = (("sample", ""), ("time", "s"), ("faults", ""))
"""Names and units."""


class EpicsSender:
    """Follows the newest run of a folder and publishes its newest row."""

    def __init__(self, folder: Path, prefix: str, may_change: bool) -> None:
        """Start to serve.

        Args:
            folder: The watched folder.
            prefix: What every name begins with, such as "LAB:VO2:".
            may_change: Whether clients may set set-point and gains.

        Raises:
            InputError: the prefix is none, the package caproto is missing, or nothing can be served here.
        """
        self._follower = Follower(folder)
        self._events: EventLog | None = None
        self._due_s = 0.0
        self._access = ChannelAccess(checked_prefix(prefix), self._set if may_change else None)
        self._access.offer(COUNTS, TEXTS)

    def look(self) -> None:
        """Publish the newest row, at most ten times a second."""
        now_s = time.monotonic()
        if now_s < self._due_s:
            return
        self._due_s = now_s + PUBLISH_EVERY_S
        begun, description, state = self._follower.look(), self._follower.description, self._follower.state()
        texts: dict[str, str] = {"state": state}
        numbers: dict[str, float] = {}
        if description is not None:
            if begun:
                self._begin(description)
                numbers |= {"faults": 0.0, **self._gains(description)}
            numbers |= self._newest(description)
            texts["verdict"] = _verdict(description, state)
            numbers |= self._happened(description, texts)
        self._access.publish(numbers, texts)

    def close(self) -> None:
        """Serve no more."""
        self._access.close()
        self._follower.close()

    def _begin(self, description: Description) -> None:
        """Turn to another recording; names that it does not have become invalid."""
        variables = variables_of(description)
        settable = {one.name: one.parameter for one in variables if one.parameter}
        self._access.invalidate()
        self._access.offer([(one.name, one.unit) for one in variables], (), settable)
        is_run = description.place.record is None
        self._events = (
            EventLog(description.place.folder, description.scenario, description.period_s) if is_run else None
        )

    def _newest(self, description: Description) -> dict[str, float]:
        count = description.rows.count()
        if count == self._follower.taken:
            return {}
        self._follower.taken = count
        table = description.rows.read(count - 1, count)
        return {
            **values_of(description, table),
            "sample": float(count),
            "time": description.time_s(count - 1),
        }

    def _happened(self, description: Description, texts: dict[str, str]) -> dict[str, float]:
        """Put the newest fault into `texts`; return the number of faults, and the gains, where anything happened."""
        events = None if self._events is None else self._events.changed()
        if events is None or self._events is None:
            return {}
        faults = [event for event in events if event.kind == "fault"]
        texts["fault"] = self._events.words(faults[-1]) if faults else ""
        return {"faults": float(len(faults)), **self._gains(description)}

    def _gains(self, description: Description) -> dict[str, float]:
        """Return the gains of a run that is under way, by name of the variable."""
        with suppress(InputError, RunError):  # it has ended
            found = parameters(description.place.folder)
            return {name.removeprefix(GAINS): value for name, value in found.items()}
        return {}

    def _set(self, parameter: str, value: float) -> str:
        """Change the run; return what was changed in words. Raises InputError, RunError."""
        description = self._follower.description
        if description is None:
            raise InputError("no run is under way")
        if not math.isfinite(value):
            raise InputError(f"{parameter} = {value}: a finite number is needed")
        return send(description.place.folder, parameter, value).in_words()


def _verdict(description: Description, state: str) -> str:
    """Return the verdict of a run that has ended; "" before."""
    found = verdict_of(description.place.folder) if state == "ended" else None
    return "" if found is None else str(found["verdict"])


def checked_prefix(prefix: str) -> str:
    """Return `prefix`. Raises InputError for one that no name of EPICS may begin with."""
    allowed = prefix.isascii() and all(letter.isalnum() or letter in "_-+:[]<>;" for letter in prefix)
    if not prefix or not allowed:
        raise InputError(
            f'--epics "{prefix}": a prefix of letters, digits and _ - + : [ ] < > ; is needed, such as LAB:VO2:'
        )
    return prefix
