"""Faults of a wire on purpose: a burst of bytes goes in, what comes out and when; no port, no clock, one seed.

A burst is what arrives in one read: as a rule one request or one answer. `rate` is the share of bursts that a
disturbance strikes. Order is kept, save by `reorder`: a line cannot be overtaken.
"""

from __future__ import annotations

import random
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple

from rtctl.border.errors import InputError


class Kind(StrEnum):
    """A kind of fault of a line, of the device behind it or of the host before it."""

    DELAY = "delay"  # the burst comes `duration` later, and what follows waits
    JITTER = "jitter"  # the same, for a random part of `duration`
    DROP = "drop"  # it never comes
    DUPLICATE = "duplicate"  # it comes twice
    REORDER = "reorder"  # it comes `duration` later, what follows does not wait
    BIT_FLIP = "bit_flip"  # one bit of it is another
    TRUNCATE = "truncate"  # its end is missing
    STALL = "stall"  # nothing passes in either direction for `duration`
    DISCONNECT = "disconnect"  # the connection breaks and comes back after `duration`
    DEVICE_REBOOT = "device_reboot"  # the device restarts, its levels off, its settings gone
    HOST_PAUSE = "host_pause"  # the host's program stands still for `duration` (SIGSTOP)


class Way(StrEnum):
    """The direction of a burst."""

    TO_DEVICE = "to_device"
    TO_HOST = "to_host"


@dataclass(frozen=True, slots=True, kw_only=True)
class Disturbance:
    """A kind of fault, how often and how long."""

    kind: Kind
    rate: float
    """Share of bursts, 0 to 1."""
    duration_s: float = 0.0
    way: Way | None = None
    """Direction; None: both."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.rate <= 1.0:
            raise InputError(f"{self.kind}: rate is a share of the bursts, 0 to 1, got {self.rate!r}")
        if not 0.0 <= self.duration_s <= 60.0:
            raise InputError(f"{self.kind}: duration must be 0 to 60 s, got {self.duration_s!r} s")


class Delivery(NamedTuple):
    """Bytes that come out of the line, and when."""

    due_s: float
    way: Way
    data: bytes


class Injected(NamedTuple):
    """A fault that was injected."""

    time_s: float
    kind: Kind
    way: Way


class Passed(NamedTuple):
    """The fate of a burst."""

    deliveries: list[Delivery]
    struck: list[Disturbance]
    """Faults that the caller has to carry out: disconnect, reboot, pause."""


_BY_THE_CALLER = (Kind.DISCONNECT, Kind.DEVICE_REBOOT, Kind.HOST_PAUSE)


class FaultyLine:
    """A line with faults; `injected` is its log."""

    def __init__(self, disturbances: Sequence[Disturbance], seed: int) -> None:
        self._disturbances = tuple(disturbances)
        self._random = random.Random(seed)
        self._free_s = dict.fromkeys(Way, 0.0)  # when the last burst of a direction has come out
        self._asked: deque[Disturbance] = deque()
        self.injected: list[Injected] = []
        self.by_chance: Counter[Kind] = Counter()
        """How many of them struck a share of the bursts, and were not asked for, by kind."""

    def ask(self, disturbance: Disturbance) -> None:
        """Let a disturbance strike the next burst, once; `rate` is not looked at. From any thread."""
        self._asked.append(replace(disturbance, rate=1.0))

    def passes(self, way: Way, data: bytes, now_s: float) -> Passed:
        """Pass a burst that goes in at `now_s` [s]."""
        due_s, copies, overtaken, struck = now_s, 1, False, []
        asked = [self._asked.popleft() for _ in range(len(self._asked))]
        for number, disturbance in enumerate((*asked, *self._disturbances)):
            kind, duration_s = disturbance.kind, disturbance.duration_s
            if disturbance.way not in (None, way) or self._random.random() >= disturbance.rate:
                continue
            self.injected.append(Injected(now_s, kind, way))
            self.by_chance[kind] += number >= len(asked)
            if kind in _BY_THE_CALLER:
                struck.append(disturbance)
            elif kind is Kind.DROP:
                copies = 0
            elif kind is Kind.DUPLICATE:
                copies = 2
            elif kind is Kind.BIT_FLIP:
                data = self._flipped(data)
            elif kind is Kind.TRUNCATE:
                data = data[: self._random.randrange(len(data))]
            elif kind is Kind.STALL:
                for direction in Way:
                    self._free_s[direction] = max(self._free_s[direction], now_s + duration_s)
            else:
                due_s += duration_s * (self._random.random() if kind is Kind.JITTER else 1.0)
                overtaken |= kind is Kind.REORDER
        if not overtaken:
            due_s = self._free_s[way] = max(due_s, self._free_s[way])
        return Passed([Delivery(due_s, way, data)] * (copies if data else 0), struck)

    def _flipped(self, data: bytes) -> bytes:
        bit = self._random.randrange(8 * len(data))
        at = bit // 8
        return data[:at] + bytes((data[at] ^ 1 << bit % 8,)) + data[at + 1 :]
