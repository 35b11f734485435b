"""The line before a served device, with faults on purpose: what passes to the device, and back to its host."""

from __future__ import annotations

from collections.abc import Iterable

from drivers.fault_line import Disturbance, FaultyLine, Kind, Passed, Way

Share = tuple[str, float, float, str | None]
"""A kind of fault, the share of bursts that it strikes, its duration [s], "to_device" or "to_host"; None: both."""
Deliveries = list[tuple[float, bytes]]
"""Bytes that come out of the line, and when [s]."""
Struck = list[tuple[str, float]]
"""Faults that the server has to carry out: kind, duration [s]."""


class ServedLine:
    """A line with faults, for a server (`plant_sim.wire.faulty_wire.Line`)."""

    kinds = tuple(str(kind) for kind in Kind if kind is not Kind.HOST_PAUSE)
    """Faults that a server can make: it knows nothing of the host's process."""

    def __init__(self, struck: Iterable[Share] = (), seed: int = 0) -> None:
        """Make a line of which shares of the bursts are struck. Raises InputError for a number out of range."""
        disturbances = [
            Disturbance(
                kind=Kind(kind), rate=rate, duration_s=duration_s, way=None if way is None else Way(way)
            )
            for kind, rate, duration_s, way in struck
        ]
        self._line = FaultyLine(disturbances, seed)

    @property
    def injected(self) -> int:
        """Faults so far."""
        return len(self._line.injected)

    def struck_by_chance(self) -> dict[str, int]:
        """Return how many bursts were struck as a share of them, by kind of fault."""
        return {str(kind): count for kind, count in self._line.by_chance.items()}

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
