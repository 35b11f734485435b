"""A dataset whose records stay in their files until they are requested: one at a time, however many there are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.border.errors import nearest
from rtctl.measured.dataset import Record, Signal, signals_of


class RecordHead(NamedTuple):
    """Properties of a record in the manifest; see `Record`."""

    name: str
    file: str
    use: str
    repeat: str | None
    conditions: Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredDataset:
    """A checked manifest and its files; fields as in `Dataset`.

    Each `Record` is read anew on request and nothing of it is kept: drop it before the next, and
    memory holds one. Reading raises InputError where the numbers are wrong (gaps, text, an uneven time column).
    """

    path: Path
    name: str
    plant: str
    identity: str = ""
    units: Mapping[str, str]
    holds: Mapping[str, str]
    heads: tuple[RecordHead, ...]
    """Heads of all records, in the manifest's order."""
    read: Callable[[int], Record]
    """Reads the k-th record from its file."""
    remarked: Callable[[], tuple[str, ...]] = tuple
    """Returns the remarks so far."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """As in `Dataset`, of the manifest, the files, and the records that were read so far."""
        return self.remarked()

    def __len__(self) -> int:
        return len(self.heads)

    def __iter__(self) -> Iterator[Record]:
        return (self.read(k) for k in range(len(self.heads)))

    def used_for(self, use: str) -> Iterator[Record]:
        """Yield the records of one use, in order."""
        return (self.read(k) for k, head in enumerate(self.heads) if head.use == use)

    def record(self, name: str) -> Record:
        """Return one record by its name. Raises KeyError with the nearest name."""
        for k, head in enumerate(self.heads):
            if head.name == name:
                return self.read(k)
        raise KeyError(f'no record "{name}"{nearest(name, [head.name for head in self.heads])}')

    @property
    def signals(self) -> dict[str, Signal]:
        """Every signal with its role, unit and hold, in the manifest's order."""
        return signals_of(self.units, self.holds)
