"""The protocol of a line with faults before a served device (`drivers.served_line`)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

Passed = tuple[list[tuple[float, bytes]], list[tuple[str, float]]]
"""Bytes that come out and when [s]; faults that the server carries out, with their durations [s]."""


class Line(Protocol):
    """A line with faults; times are those of the event loop [s]."""

    kinds: tuple[str, ...]
    """Faults that can be asked for."""

    @property
    def injected(self) -> int:
        """Faults so far."""
        ...

    def struck_by_chance(self) -> Mapping[str, int]:
        """Return how many bursts were struck as a share of them, by kind of fault."""
        ...

    def ask(self, kind: str, duration_s: float) -> None:
        """Let a fault strike the next burst of bytes, once."""
        ...

    def to_device(self, data: bytes, now_s: float) -> Passed:
        """Pass a request."""
        ...

    def to_host(self, data: bytes, now_s: float) -> Passed:
        """Pass an answer."""
        ...
