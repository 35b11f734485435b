"""Rows of one recording by their number, wherever they lie: a file that grows, Parquet, a record of a dataset."""

from __future__ import annotations

import json
import zlib
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.recording.tail import Tail

INDEX = "index"
"""Column of the sample's number in the plan; gaps in it are missed periods."""
GROUPS_KEPT = 2
"""Row groups of a Parquet file that are held in memory: neighbours, for a range across their border."""


class RecordedRows(Protocol):
    """Rows 0, 1, 2 ... of one recording; reading them changes nothing and waits for nothing."""

    key: str
    """Eight hexadecimal digits; the same for the same recording, whether it grows, has ended or was opened anew."""
    path: Path
    """The file that was opened."""
    columns: Sequence[tuple[str, str]]
    """Names and units."""
    metadata: Mapping[str, str]

    def count(self) -> int:
        """Return how many rows there are by now."""
        ...

    def read(self, first: int, last: int) -> Mapping[str, FloatArray]:
        """Return the columns (rows,) of the rows from `first` on, before `last`."""
        ...

    def replaced(self) -> bool:
        """Return whether the file is no longer the one that was opened."""
        ...

    def close(self) -> None:
        """Close the file."""
        ...


class GrowingRows:
    """The rows of a `signals.rec`, under way or left by a run that was killed."""

    columns: Sequence[tuple[str, str]]
    metadata: Mapping[str, str]

    def __init__(self, path: Path) -> None:
        """Open the file. Raises InputError before its first row is whole, OSError if there is no such file."""
        self.path, self._tail = path, Tail(path)
        if self._tail.look() == 0:
            self._tail.close()
            raise InputError(f"{path}: no row yet")
        header = self._tail.header
        self.columns, self.metadata = header.columns, header.metadata
        self.key = recording_key(self.columns, self.metadata, self._tail.read(0, 1))
        self.count, self.read, self.replaced, self.close = (
            self._tail.look, self._tail.read, self._tail.replaced, self._tail.close,
        )  # fmt: skip


class ParquetRows:
    """The rows of a `signals.parquet`, read a row group at a time."""

    columns: Sequence[tuple[str, str]]
    metadata: Mapping[str, str]

    def __init__(self, path: Path) -> None:
        """Open the file. Raises InputError if it is none or has no row, OSError if there is no such file."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        self.path, self._stamp = path, _stamp(path)
        try:
            self._file = pq.ParquetFile(path)
        except pa.ArrowInvalid as error:
            raise InputError(f"{path}: cannot be read as Parquet: {error}") from None
        schema = self._file.schema_arrow
        self.columns = [(one.name, (one.metadata or {}).get(b"unit", b"").decode()) for one in schema]
        self.metadata = {key.decode(): value.decode() for key, value in (schema.metadata or {}).items()}
        sizes = [self._file.metadata.row_group(k).num_rows for k in range(self._file.metadata.num_row_groups)]
        self._begins = np.concatenate(([0], np.cumsum(sizes))).astype(np.int64)
        self._groups: OrderedDict[int, dict[str, FloatArray]] = OrderedDict()
        if not self.count():
            self.close()
            raise InputError(f"{path}: has no row")
        self.key = recording_key(self.columns, self.metadata, self.read(0, 1))

    def count(self) -> int:
        """Return how many rows there are."""
        return int(self._begins[-1])

    def read(self, first: int, last: int) -> dict[str, FloatArray]:
        """Return the columns (rows,) of the rows from `first` on, before `last`."""
        parts = []
        groups = range(int(np.searchsorted(self._begins, first, side="right")) - 1, len(self._begins) - 1)
        for number in groups:
            begin = int(self._begins[number])
            if begin >= last:
                break
            group = self._group(number)
            parts.append({name: group[name][max(first - begin, 0) : last - begin] for name in group})
        if not parts:
            return {name: np.zeros(0) for name, _ in self.columns}
        return {name: np.concatenate([part[name] for part in parts]) for name, _ in self.columns}

    def replaced(self) -> bool:
        """Return whether another file, or none, has taken the place of this one."""
        return _is_another(self.path, self._stamp)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _group(self, number: int) -> dict[str, FloatArray]:
        if number not in self._groups:
            table = self._file.read_row_group(number)
            self._groups[number] = {
                name: table[name].to_numpy().astype(np.float64) for name, _ in self.columns
            }
            if len(self._groups) > GROUPS_KEPT:
                self._groups.popitem(last=False)
        return self._groups[number]


class RecordRows:
    """The rows of a record of a dataset."""

    columns: Sequence[tuple[str, str]]
    metadata: Mapping[str, str]

    def __init__(self, manifest: Path, number: int) -> None:
        """Read a record by its place in the manifest. Raises InputError if there is none, or the manifest is wrong."""
        from rtctl.measured.reading import open_dataset

        self.path, self._stamp = manifest, _stamp(manifest)
        dataset = open_dataset(manifest)
        if number >= len(dataset.heads):
            raise InputError(f"{manifest}: has no record {number + 1}, it ends with {len(dataset.heads)}")
        record = dataset.read(number)
        self._signals = {INDEX: np.arange(record.samples, dtype=np.float64), **record.signals}
        self.columns = [(one, dataset.units.get(one, "")) for one in self._signals]
        self.metadata = {
            "title": f"{dataset.name}: {record.name}",
            "period_s": repr(record.period_s),
            "inputs": json.dumps([one for one in record.signals if one in dataset.holds]),
        }
        self.key = recording_key(self.columns, self.metadata, self.read(0, 1))

    def count(self) -> int:
        """Return how many rows there are."""
        return len(self._signals[INDEX])

    def read(self, first: int, last: int) -> dict[str, FloatArray]:
        """Return the columns (rows,) of the rows from `first` on, before `last`."""
        return {name: values[first:last] for name, values in self._signals.items()}

    def replaced(self) -> bool:
        """Return whether the manifest is another one by now, or gone."""
        return _is_another(self.path, self._stamp)

    def close(self) -> None:
        """Keep nothing open."""


def recording_key(
    columns: Sequence[tuple[str, str]], metadata: Mapping[str, str], first_row: Mapping[str, FloatArray]
) -> str:
    """Return what tells a recording from another one: columns, scenario and the first row."""
    row = [float(values[0]) for values in first_row.values()]
    text = json.dumps([list(map(list, columns)), sorted(metadata.items()), row])
    return f"{zlib.crc32(text.encode()):08x}"


def _stamp(path: Path) -> tuple[int, int]:
    found = path.stat()
    return found.st_ino, found.st_mtime_ns


def _is_another(path: Path, stamp: tuple[int, int]) -> bool:
    """Return whether another file, or none, has taken the place of the one with `stamp`."""
    try:
        return _stamp(path) != stamp
    except OSError:
        return True
