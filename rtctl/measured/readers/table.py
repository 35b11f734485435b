"""Common result of all readers: a header of each column without its numbers, and rows of a column on request."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.compute
from numpy.typing import NDArray

from rtctl.measured.readers.groups import Place
from rtctl.measured.readers.stated.attributes import (
    packing_of,
    stated_decimation,
    stated_unit,
    text_of,
    texts_of,
    unapplied,
    unpack,
)
from rtctl.measured.readers.stated.beside import Level, Period
from rtctl.measured.readers.stated.preamble import NOTHING, Preamble
from rtctl.measured.readers.stated.rate import stated_period
from rtctl.measured.readers.stated.start import stated_start

Column = NDArray[Any]
PieceT = TypeVar("PieceT", pa.Array, pa.RecordBatch)


class Header(NamedTuple):
    """Properties of a column that the file states before its numbers are read."""

    shape: tuple[int, ...]
    """Shape: (n,), (n, 1) or (1, n) of a signal; anything else is refused when it is used."""
    dtype: np.dtype[Any] | None = None
    """Type; None where only the numbers themselves show it (CSV)."""
    unit: str | None = None
    """Unit that the file states, for a cross-check."""
    period_s: float | None = None
    """Sample period [s] that the file states, for a cross-check."""
    period_key: str = ""
    """Key under which the file states the period."""
    start_s: float | None = None
    """Time [s] of the first sample that the file states, from an origin that its columns share."""
    start_key: str = ""
    """Key under which the file states it."""
    begun: tuple[int, ...] = ()
    """Rows with which the file states that a further acquisition begins, with time between it and the last one."""
    refusal: str = ""
    """Why the column is no signal, as a phrase that continues its name."""
    unapplied: str = ""
    """What the file states of a scale that is not applied, as `key = value`; "": nothing."""
    decimation: str = ""
    """What it states of samples that were left out, as `key = value`; "": nothing."""
    alias_of: str = ""
    """Column whose numbers it has, under another name; "": they are its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Columns of one file. `load` may raise ValueError in words."""

    columns: Mapping[str, Header]
    load: Callable[[str, int, int], Column]
    """Returns rows [first, end) of a column; `end` is at most the column's length."""
    load_together: Callable[[Sequence[str]], Mapping[str, Column]] | None = None
    """Returns all rows of several columns, where that is cheaper than one by one; columns that are no numbers are left
    to `load`. Columns without a refusal may be asked for."""
    piecewise: bool = True
    """Whether single rows are cheap to read; if not, the whole column is read (or skipped over) for any of them."""
    remarks: tuple[str, ...] = ()
    """What a user must know of a file that can be read."""
    preamble: Preamble = NOTHING
    """What a text file states of its sample rate above its columns."""
    texts: Mapping[str, str] = field(default_factory=dict)
    """What the file says in words beside its columns, by where it stands: a line, an attribute."""
    places: Mapping[str, Place] = field(default_factory=dict)
    """Place of each column in the groups of the file; columns without one are at the top."""

    beside: Mapping[str, Level] = field(default_factory=dict)
    """What stands beside the columns of each group, by its path; "": of the file."""
    periods: Mapping[str, Period] = field(default_factory=dict)
    """Sample periods [s] that stand beside columns."""

    def place(self, name: str) -> Place:
        """Return the place of a column."""
        return self.places.get(name, Place(name))


def length(shape: Sequence[int]) -> int:
    """Return the samples of a vector, or 0. Raises ValueError in words for several dimensions."""
    samples = max(shape, default=1)
    if int(np.prod(shape, dtype=np.int64)) != samples:
        raise ValueError(f"has shape {tuple(shape)}, one dimension is needed; save one array a signal")
    return samples


def vector_rows(shape: Sequence[int], first: int, end: int) -> tuple[slice, ...]:
    """Return the index of rows [first, end) of a vector, row or column."""
    axis = int(np.argmax(shape)) if shape else 0
    return tuple(slice(first, end) if k == axis else slice(None) for k in range(len(shape)))


@contextmanager
def reading(kind: str) -> Iterator[None]:
    """Turn any exception of a foreign parser into a ValueError that says "not <kind>" or "damaged"."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"not {kind}, or damaged: {_first_line(error)}") from None
    except (
        Exception
    ) as error:  # parsers stumble over damaged bytes in any way: struct, zlib, Key, Memory errors
        raise ValueError(f"not {kind}, or damaged: {type(error).__name__} {_first_line(error)}") from None


def check_distinct(names: Sequence[str]) -> None:
    """Raise ValueError if a name appears twice."""
    if len(set(names)) < len(names):
        raise ValueError(f"two columns have the same name; columns: {', '.join(names)}")


class ArrowField(NamedTuple):
    """A column of Arrow data: a field, or a field of a struct, `x.value`."""

    path: tuple[str, ...]
    field: pa.Field


def arrow_fields(schema: pa.Schema) -> dict[str, ArrowField]:
    """Return the columns of Arrow data by their names. Raises ValueError where two have the same name."""
    found: list[tuple[str, ArrowField]] = []

    def add(field: pa.Field, above: tuple[str, ...]) -> None:
        path = (*above, field.name)
        if pa.types.is_struct(field.type):
            for k in range(field.type.num_fields):
                add(field.type.field(k), path)
        else:
            found.append((".".join(path), ArrowField(path, field)))

    for entry in schema:
        add(entry, ())
    check_distinct([name for name, _ in found])
    return dict(found)


def arrow_part(pieces: Iterable[pa.Array], path: Sequence[str]) -> Iterator[pa.Array]:
    """Yield pieces of a column of a struct's field from those of the struct; missing structs have missing fields."""
    for piece in pieces:
        yield pa.compute.struct_field(piece, list(path[1:])) if len(path) > 1 else piece


def arrow_headers(schema: pa.Schema, rows: int) -> dict[str, Header]:
    """Return the headers of Arrow columns; a field's metadata may state its unit."""
    headers = {}
    for name, (_, entry) in arrow_fields(schema).items():
        attributes = _texts(entry.metadata or {})
        try:
            packing_of(attributes)
            refusal = ""
        except ValueError as error:
            refusal = str(error)
        start_s, start_key = stated_start(attributes) or (None, "")
        if _is_list(entry.type):
            refusal = (
                "holds a list in each row, one number is needed: write a row for each number (in pandas: explode), or "
                "a column for each place in the lists"
            )
        period_s, key = stated_period(attributes, _texts(schema.metadata or {})) or (None, "")
        headers[name] = Header(
            shape=(rows,), unit=stated_unit(attributes), refusal=refusal,
            unapplied=unapplied(attributes), period_s=period_s, period_key=key,
            start_s=start_s, start_key=start_key, decimation=stated_decimation(attributes),
        )  # fmt: skip
    return headers


def _is_list(kind: pa.DataType) -> bool:
    tests = (pa.types.is_list, pa.types.is_large_list, pa.types.is_fixed_size_list, pa.types.is_map)
    return any(test(kind) for test in tests)


def arrow_texts(schema: pa.Schema) -> dict[str, str]:
    """Return what metadata say in words: those of the schema and of its fields."""
    found = texts_of(_texts(schema.metadata or {}))
    for name, (_, entry) in arrow_fields(schema).items():
        found |= texts_of(_texts(entry.metadata or {}), name)
    return found


def arrow_beside(schema: pa.Schema) -> dict[str, Level]:
    """Return what the schema's metadata state of its columns."""
    return {"": _texts(schema.metadata or {})}


def arrow_readings(schema: pa.Schema, name: str, stored: Column) -> Column:
    """Return the readings of stored numbers, unpacked as the field's metadata say."""
    return unpack(stored, packing_of(_texts(arrow_fields(schema)[name].field.metadata or {})))


def _texts(metadata: Mapping[bytes, bytes]) -> dict[str, str]:
    return {text_of(key): text_of(value) for key, value in metadata.items()}


def arrow_slice(pieces: Iterator[pa.Array], first: int, end: int) -> Column:
    """Return rows [first, end) of consecutive pieces; the pieces after the last row are not requested."""
    wanted = [arrow_numbers(piece) for piece in arrow_parts(pieces, first, end)]
    return np.concatenate(wanted) if wanted else np.empty(0)


def arrow_parts(pieces: Iterable[PieceT], first: int, end: int) -> Iterator[PieceT]:
    """Yield what consecutive pieces have of rows [first, end); pieces after the last row are not requested."""
    start = 0
    for piece in pieces:
        stop = start + len(piece)
        if stop > first and start < end:
            yield piece.slice(max(first - start, 0), min(end, stop) - max(first, start))
        start = stop
        if start >= end:
            break


def arrow_numbers(column: pa.Array) -> Column:
    """Return numbers as float64 with NaN for nulls; anything else as it is, for the message about it."""
    kind = column.type
    if pa.types.is_null(kind):
        return np.full(len(column), np.nan)
    if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind):
        values: Column = column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
        return values
    if pa.types.is_decimal(kind):
        return arrow_numbers(column.cast(pa.float64()))
    if pa.types.is_dictionary(kind):
        return arrow_numbers(column.dictionary_decode())
    return np.asarray(column.to_numpy(zero_copy_only=False))


def _first_line(error: Exception) -> str:
    return (str(error).strip() or "no reason given").splitlines()[0][:300]
