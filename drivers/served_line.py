"""The line before a served device, with faults on purpose: what passes to the device, and back to its host."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.fault_line import Disturbance, FaultyLine, Kind, Passed, Way

Deliveries = list[tuple[float, bytes]]
"""Bytes that come out of the line, and when [s]."""
Struck = list[tuple[str, float]]
"""Faults that the server has to carry out: kind, duration [s]."""


class ServedLine:
    """A line with faults, for a server (`plant_sim.wire.faulty_wire.Line`)."""

    kinds = tuple(str(kind) for kind in Kind if kind is not Kind.HOST_PAUSE)
    """Faults that a server can make: it knows nothing of the host's process."""

    def __init__(self, disturbances: Sequence[Disturbance], seed: int) -> None:
        self._line = FaultyLine(disturbances, seed)

    @property
    def injected(self) -> int:
        """Faults so far."""
        return len(self._line.injected)

    def ask(self, kind: str, duration_s: float) -> None:
        """Let a fault strike the next burst of bytes, once. Raises InputError for a duration that is too long."""
        self._line.ask(Disturbance(kind=Kind(kind), rate=1.0, duration_s=duration_s))

    def to_device(self, data: bytes, now_s: float) -> tuple[Deliveries, Struck]:
        """Pass a request that comes at `now_s` [s]."""
        return _plain(self._line.passes(Way.TO_DEVICE, data, now_s))

    def to_host(self, data: bytes, now_s: float) -> tuple[Deliveries, Struck]:
        """Pass an answer."""
        return _plain(self._line.passes(Way.TO_HOST, data, now_s))


def _plain(passed: Passed) -> tuple[Deliveries, Struck]:
    return (
        [(one.due_s, one.data) for one in passed.deliveries],
        [(str(one.kind), one.duration_s) for one in passed.struck],
    )
