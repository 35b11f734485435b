"""The file of a recording under way: a header, then numbered rows of fixed size; readable at any moment.

    0      magic "RTCTLREC", uint32 length of the header, the header as JSON (columns, units, metadata)
    begin  rows: the columns as float64, then the row's number as uint64, from 1 on; little-endian

`begin` is the next multiple of 4096. A row's number is written after its values, so a row that has its number is whole
whenever the writer was killed; what comes after the last one is zero.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError

MAGIC = b"RTCTLREC"
PAGE = 4096
_PREFIX = struct.Struct("<8sI")


class Header(NamedTuple):
    """The header of a file of rows."""

    columns: list[tuple[str, str]]
    """Names and units of the columns."""
    metadata: dict[str, str]
    begin: int
    """Offset of the first row [bytes]."""


def stride_of(columns: int) -> int:
    """Return the size of a row [bytes]."""
    return 8 * (columns + 1)


def header_bytes(columns: list[tuple[str, str]], metadata: Mapping[str, str]) -> bytes:
    """Return the header, padded to whole pages."""
    text = json.dumps({"columns": columns, "metadata": dict(metadata)}).encode()
    used = _PREFIX.pack(MAGIC, len(text)) + text
    return used.ljust(-(-len(used) // PAGE) * PAGE, b"\0")


def read_header(path: Path) -> Header:
    """Read the header of a recording. Raises InputError if the file is none."""
    with path.open("rb") as file:
        prefix = file.read(_PREFIX.size)
        magic, length = _PREFIX.unpack(prefix) if len(prefix) == _PREFIX.size else (b"", 0)
        text = file.read(length) if magic == MAGIC else b""
    if magic != MAGIC or len(text) != length:
        raise InputError(f"{path}: not a recording of rtctl, or killed before its first row")
    content = json.loads(text)
    columns = [(str(name), str(unit)) for name, unit in content["columns"]]
    return Header(columns, content["metadata"], -(-(_PREFIX.size + length) // PAGE) * PAGE)


class Rows:
    """The complete rows of a recording, mapped; `table` reads a column at a time."""

    def __init__(self, path: Path) -> None:
        """Map the file at `path`. Raises InputError if it is no recording."""
        self.header = read_header(path)
        names = [name for name, _ in self.header.columns]
        layout = np.dtype([*((name, "<f8") for name in names), ("row number", "<u8")])
        room = max(path.stat().st_size - self.header.begin, 0) // layout.itemsize
        self._rows = (
            np.memmap(path, dtype=layout, mode="r", offset=self.header.begin, shape=(room,))
            if room
            else np.zeros(0, dtype=layout)
        )
        self.count = _whole(self._rows["row number"])

    def __len__(self) -> int:
        return self.count

    def table(self) -> ColumnsOnDemand:
        """Return the columns by name; each is read when it is asked for, and not kept."""
        return ColumnsOnDemand(self._rows[: self.count], [name for name, _ in self.header.columns])


class ColumnsOnDemand(Mapping[str, FloatArray]):
    """Columns (rows,) of a file of rows, without having them all in memory."""

    def __init__(self, rows: NDArray[np.void], names: list[str]) -> None:
        self._rows = rows
        self._names = names

    def __getitem__(self, name: str) -> FloatArray:
        if name not in self._names:
            raise KeyError(name)
        return np.ascontiguousarray(self._rows[name])

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def parts(self, rows: int) -> Iterator[dict[str, FloatArray]]:
        """Yield all columns of at most `rows` rows at a time; one empty part if there is no row."""
        for begin in range(0, max(len(self._rows), 1), rows):
            part = self._rows[begin : begin + rows]
            yield {name: np.ascontiguousarray(part[name]) for name in self._names}


def _whole(numbers: NDArray[np.uint64]) -> int:
    """Return how many rows are numbered 1, 2, 3 ... from the start: they are written in order, so by bisection."""
    low, high = 0, len(numbers)
    while low < high:
        middle = (low + high) // 2
        if int(numbers[middle]) == middle + 1:
            low = middle + 1
        else:
            high = middle
    return low
