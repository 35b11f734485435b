"""A raw column to a float64 array, or a message that says which rows are wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtctl.border.errors import nearest
from rtctl.measured.readers import Table, open_table
from rtctl.measured.units import same_unit

FloatArray = NDArray[np.float64]


class TableCache:
    """Files of one manifest: each opened once and each column read once, since records may share a file."""

    def __init__(self) -> None:
        self._tables: dict[Path, Table] = {}
        self._columns: dict[tuple[Path, str], FloatArray] = {}

    def table(self, path: Path) -> Table:
        """The opened file. Raises ValueError in words."""
        if path not in self._tables:
            self._tables[path] = open_table(path)
        return self._tables[path]

    def column(self, path: Path, name: str, unit: str) -> FloatArray:
        """The numbers of a column (n,); NaN where a file has gaps. Raises ValueError in words."""
        table = self.table(path)
        if name not in table.columns:
            raise ValueError(f'no column "{name}"{nearest(name, table.columns)}')
        _check_stated_unit(table, name, unit)
        if (path, name) not in self._columns:
            self._columns[path, name] = numbers(table.load(name), name)
        return self._columns[path, name]


def numbers(raw: NDArray[Any], name: str) -> FloatArray:
    """`raw` as contiguous float64 (n,). Raises ValueError for text, several dimensions and other kinds."""
    if raw.size != max(raw.shape, default=0):
        raise ValueError(
            f'column "{name}" has shape {raw.shape}, one dimension is needed; save one array a signal'
        )
    flat = raw.reshape(-1)
    if flat.dtype.kind in "OUS":
        raise ValueError(_about_text(flat, name))
    if flat.dtype.kind not in "biuf":
        raise ValueError(f'column "{name}" holds {flat.dtype.name}, real numbers are needed')
    return np.ascontiguousarray(flat, dtype=np.float64)


def check_finite(values: FloatArray, name: str, first_row: int) -> None:
    """Raise ValueError with the rows (of the file, from 0) where `values` are NaN or infinite."""
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        kinds = "NaN" if np.isnan(values[bad]).all() else "NaN or infinite"
        raise ValueError(
            f'column "{name}" is {kinds} in {len(bad)} of {len(values)} rows: {rows_text(bad + first_row)}; '
            "correct the file, or leave these rows out with rows = [first, end]"
        )


def rows_text(rows: NDArray[np.intp], shown: int = 5) -> str:
    """`3, 17, 18 and 12 more (counted from 0)`."""
    text = ", ".join(str(row) for row in rows[:shown])
    more = f" and {len(rows) - shown} more" if len(rows) > shown else ""
    return f"{'row' if len(rows) == 1 else 'rows'} {text}{more} (counted from 0)"


def _about_text(flat: NDArray[Any], name: str) -> str:
    bad = np.asarray([row for row, value in enumerate(flat) if not _is_number(value)], dtype=np.intp)
    if not len(bad):
        return f'column "{name}" holds numbers as text; store them as numbers'
    value = str(flat[bad[0]])[:40]
    return f'column "{name}" holds text, numbers are needed: "{value}", in {rows_text(bad)}'


def _is_number(value: object) -> bool:
    try:
        float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return value is None or value == ""  # a gap: found as NaN once the text is corrected
    return True


def _check_stated_unit(table: Table, name: str, unit: str) -> None:
    stated = table.units.get(name)
    if stated is None:
        return
    try:
        agrees = same_unit(stated, unit)
    except ValueError:
        return  # metadata of a foreign writer that is not a unit says nothing
    if not agrees:
        raise ValueError(
            f'the file states unit "{stated}" for column "{name}", the manifest "{unit}"; correct one'
        )
