"""Convert a raw column to a float64 array, or report which rows are wrong."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import nearest
from rtctl.measured.amplitude_unit import is_level, is_named_logarithm
from rtctl.measured.columns.time_axis import StatedPeriod
from rtctl.measured.readers import Header, Table, open_table
from rtctl.measured.readers.groups import missing_name, names_within
from rtctl.measured.readers.table import Column, length
from rtctl.measured.stated_unit import agrees, is_no_unit, readable, stated_amplitude, unit_in_name

OVERFLOW_CODE = 9.9e37
LEAST_SIZE = 1e-60
"""Largest number of a column below which it holds nothing measured; its squares and cubes would vanish."""
_TEXT = "OUS"  # NumPy's kinds of it
KEPT_BYTES = 128 << 20
"""Bytes of numbers that are kept for the next record of the same file."""


class TableCache:
    """Files of one manifest, each opened once.

    If several records share a file, a column whose rows cannot be read without all of it (`piecewise` is false) is
    kept,
    up to `KEPT_BYTES` over all columns.
    """

    def __init__(self, shared: Iterable[Path] = ()) -> None:
        self._shared = frozenset(shared)
        self._tables: dict[Path, Table] = {}
        self._seen: dict[tuple[Path, str | None], Mapping[str, str]] = {}
        self._kept: OrderedDict[tuple[Path, str], FloatArray] = OrderedDict()

    def table(self, path: Path) -> Table:
        """Return the opened file. Raises ValueError in words."""
        if path not in self._tables:
            self._tables[path] = open_table(path)
        return self._tables[path]

    def names(self, path: Path, group: str | None) -> Mapping[str, str]:
        """Return the columns of a file by the names that they have in a group of it; None: in the file itself.

        Raises ValueError in words for a group that is not there.
        """
        key = path, group
        if key not in self._seen:
            table = self.table(path)
            places = {name: table.place(name) for name in table.columns}
            self._seen[key] = (
                {name: name for name in places} if group is None else names_within(places, group)
            )
        return self._seen[key]

    def named(self, path: Path, group: str | None, name: str) -> str:
        """Return the column that has a name in a group; of none, what it would be called. Raises ValueError."""
        known = self.names(path, group)
        if name in known or group is None:
            return known.get(name, name)
        return missing_name(self.table(path).places.values(), group, name)

    def __contains__(self, path: Path) -> bool:
        """Return whether the file was opened."""
        return path in self._tables

    def length(self, path: Path, name: str, unit: str | None) -> int:
        """Return the samples of a column, checked as far as possible without its numbers. Raises ValueError.

        `unit` is the manifest's; None: the numbers are counts, whose unit the file does not state. What the file states
        itself, word for word, is no contradiction: such a column is converted by who reads it.
        """
        samples = self.rows(path, name)
        header = self.header(path, name)
        if header.dtype is not None and header.dtype.kind not in _TEXT:  # text: the message shows some
            numbers(np.empty(0, header.dtype), name)
        stated = self.stated_unit(path, name)
        if stated is not None and stated != unit:
            _check_stated_unit(stated, name, unit)
        return samples

    def rows(self, path: Path, name: str) -> int:
        """Return the samples of a column of any type. Raises ValueError in words."""
        header = self.header(path, name)
        if header.refusal:
            raise ValueError(f'column "{name}" {header.refusal}')
        try:
            return length(header.shape)
        except ValueError as error:
            raise ValueError(f'column "{name}" {error}') from None

    def raw(self, path: Path, name: str, first: int = 0, end: int | None = None) -> Column:
        """Return rows [first, end) of a column as the file holds them, numbers, dates or text. Raises ValueError."""
        samples = self.rows(path, name)
        return self.table(path).load(name, first, samples if end is None else end)

    def column(
        self, path: Path, name: str, unit: str | None, first: int = 0, end: int | None = None
    ) -> FloatArray:
        """Return the numbers of rows [first, end) of a column; NaN for gaps in a file. Raises ValueError in words."""
        samples = self.length(path, name, unit)
        end = samples if end is None else end
        table = self.table(path)
        if table.piecewise or path not in self._shared or 8 * samples > KEPT_BYTES // 4:
            return numbers(table.load(name, first, end), name, first)
        try:
            whole = self._whole(path, name, samples)
        except ValueError:  # text, perhaps, in other rows than these
            return numbers(table.load(name, first, end), name, first)
        return whole if end - first == len(whole) else whole[first:end].copy()  # not to keep all of it alive

    def period_s(self, path: Path, name: str) -> StatedPeriod | None:
        """Return the sample period [s] that the file states for a column, and where, if it does."""
        table = self.table(path)
        header, preamble = self.header(path, name), table.preamble
        if header.period_s is not None:
            return StatedPeriod(header.period_s, header.period_key, is_of_device=bool(header.decimation))
        if preamble.period_s is not None:
            return StatedPeriod(
                preamble.period_s, f"by {preamble.source}", preamble.rounding, is_of_device=True
            )
        if (beside := table.periods.get(name)) is not None:
            return StatedPeriod(beside.period_s, beside.key, is_of_device=True, is_beside=True)
        return None

    def stated_unit(self, path: Path, name: str) -> str | None:
        """Return the unit that the file states for a column, in its attributes or behind its name."""
        stated = self.header(path, name).unit
        return unit_in_name(name) if stated is None or is_no_unit(stated) else stated

    def remarks(self, path: Path, name: str, unit: str | None) -> list[str]:
        """Return what a user must know of a column that is read as `unit` (None: as counts)."""
        stated = self.stated_unit(path, name)
        found: list[str] = []
        if unit is not None and is_named_logarithm(name):
            found.append(
                f'column "{name}": its name says that it is a logarithm; taken as it is, in {unit or "no unit"}'
            )
        if stated is not None and unit is not None and stated_amplitude(stated) is not None:
            found.append(
                f'column "{name}": the file states "{stated[:40]}", a unit of amplitudes; its rows are taken as '
                f"readings at instants, in {unit}"
            )
        elif stated is not None and unit is not None and not readable(stated):
            found.append(
                f'column "{name}": the file states "{stated[:40]}", which is no known unit; taken as {unit}'
            )
        return found

    def header(self, path: Path, name: str) -> Header:
        """Return what the file states of a column. Raises ValueError that lists the columns."""
        columns = self.table(path).columns
        if name not in columns:
            raise ValueError(f'no column "{name}"{nearest(name, columns)}')
        return columns[name]

    def _whole(self, path: Path, name: str, samples: int) -> FloatArray:
        key = (path, name)
        if key not in self._kept:
            values = numbers(self.table(path).load(name, 0, samples), name)
            while (
                self._kept and sum(kept.nbytes for kept in self._kept.values()) + values.nbytes > KEPT_BYTES
            ):
                self._kept.popitem(last=False)
            self._kept[key] = values
        self._kept.move_to_end(key)
        return self._kept[key]


def numbers(raw: NDArray[Any], name: str, first_row: int = 0) -> FloatArray:
    """Return `raw` as contiguous float64 (n,), n from row `first_row` of the file.

    Raises:
        ValueError: The column is text, has several dimensions or is of another kind.
    """
    if raw.size != max(raw.shape, default=0):
        raise ValueError(
            f'column "{name}" has shape {raw.shape}, one dimension is needed; save one array a signal'
        )
    flat = raw.reshape(-1)
    if flat.dtype.kind in _TEXT:
        raise ValueError(_about_text(flat, name, first_row))
    if flat.dtype.kind not in "biuf":
        remedy = ": save its real and its imaginary part as columns of their own" * (flat.dtype.kind == "c")
        raise ValueError(f'column "{name}" holds {flat.dtype.name}, real numbers are needed{remedy}')
    return np.ascontiguousarray(flat, dtype=np.float64)


def check_finite(values: FloatArray, name: str, first_row: int) -> None:
    """Raise ValueError with the rows (of the file, from 0) where `values` are no readings.

    They are NaN, infinite, or the code of an instrument for such: SCPI-1999 (7.2.1.4 and 7.2.1.5) has 9.9e37 for an
    infinite reading and 9.91e37 for one that is not a number.
    """
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        kinds = "NaN" if np.isnan(values[bad]).all() else "NaN or infinite"
        raise ValueError(
            f'column "{name}" is {kinds} in {len(bad)} of {len(values)} rows: {rows_text(bad + first_row)}; '
            "correct the file, or leave these rows out with rows = [first, end]"
        )
    bad = np.flatnonzero(np.abs(values) >= 0.999 * OVERFLOW_CODE)
    if len(bad):
        raise ValueError(
            f'column "{name}" is {values[bad[0]]:.4g} in {len(bad)} of {len(values)} rows: '
            f"{rows_text(bad + first_row)}. Instruments write this number where a reading overflowed; correct the "
            "file, or leave these rows out with rows = [first, end]"
        )
    size = float(np.abs(values).max(initial=0.0))
    if 0.0 < size < LEAST_SIZE:
        raise ValueError(
            f'column "{name}" is nowhere larger than {size:.3g}: no instrument measures so little; correct the file or '
            "the scale"
        )


def rows_text(rows: NDArray[np.intp], shown: int = 5) -> str:
    """Return rows as `3, 17, 18 and 12 more (counted from 0)`."""
    text = ", ".join(str(row) for row in rows[:shown])
    more = f" and {len(rows) - shown} more" if len(rows) > shown else ""
    return f"{'row' if len(rows) == 1 else 'rows'} {text}{more} (counted from 0)"


def _about_text(flat: NDArray[Any], name: str, first_row: int) -> str:
    bad = np.asarray([row for row, value in enumerate(flat) if not _is_number(value)], dtype=np.intp)
    if not len(bad):
        return f'column "{name}" holds numbers as text; store them as numbers'
    value = "".join(
        one if one.isprintable() else one.encode("unicode_escape").decode() for one in str(flat[bad[0]])[:40]
    )
    remedy = "correct or empty these cells" if 2 * len(bad) < len(flat) else "export it as numbers"
    return f'column "{name}" holds text, numbers are needed: "{value}", in {rows_text(bad + first_row)}; {remedy}'


def _is_number(value: object) -> bool:
    try:
        float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return value is None or value == ""  # a gap: found as NaN once the text is corrected
    return True


def _check_stated_unit(stated: str, name: str, unit: str | None) -> None:
    if is_level(stated):
        raise ValueError(
            f'column "{name}" is in "{stated}", a logarithm, which is no signal; export it in a linear unit. (The '
            "magnitude of a frequency response may be in dB of a reference: docs/datasets.md, Sweeps of frequencies)"
        )
    if unit is None or not readable(stated):  # a text that is no unit is remarked upon
        return
    if not agrees(stated, unit):
        raise ValueError(
            f'the file states unit "{stated}" for column "{name}", the manifest "{unit}"; correct one, or give the '
            "scale by which the column is to be multiplied (rtctl init: --scale)"
        )
