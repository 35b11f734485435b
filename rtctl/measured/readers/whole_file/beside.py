"""Units, scales and rates that a file states beside its columns: in a group, in the file, in variables of its own.

`x_unit = "um"` of a group; a table `units` (a struct of MATLAB, a JSON text of Parquet, pandas' attributes); an entry
of the column's own name that has its unit. A scale or a unit that does not say of which column is told, not applied.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rtctl.measured.readers.delimited.labview import NO_CHANNELS
from rtctl.measured.readers.stated.attributes import (
    described_scales,
    numbers_of,
    stated_decimation,
    stated_unit,
    unit_text,
)
from rtctl.measured.readers.stated.beside import MOST_NUMBERS, Level, Period
from rtctl.measured.readers.stated.keys import (
    is_fill_key,
    is_own_scale_key,
    is_scale_key,
    is_scale_of,
    is_unit_of,
    is_unit_of_all,
)
from rtctl.measured.readers.stated.rate import VARIABLES, stated_period
from rtctl.measured.readers.table import Column, Header, Table
from rtctl.measured.readers.whole_file.decimation import decimation_remarks

_DEEPEST = 3
"""Tables within tables that are looked into."""
_LONGEST_JSON = 20_000
_SAME = 1e-3
"""Relative difference of two periods up to which they are one."""
_NAMES = ("name", "channel", "column", "label", "id")
"""Keys by which an entry of a list says of which column it is."""


class _Named(NamedTuple):
    """A column, and its name within its innermost group."""

    column: str
    name: str


def with_beside(table: Table) -> Table:
    """Return a table with the units, the fill values and the rates that stand beside its columns.

    Scales, and units that do not say of which column, are remarks.
    """
    if not table.beside:
        return table
    inside = {path: list(_columns_of(table, path)) for path in ("", *_groups_of_columns(table))}
    levels = {
        path: dict(_expanded(level, [one.name for one in inside[path]]))
        for path, level in _gathered(table, inside).items()
    }
    alone = {path for path, columns in inside.items() if path and len(columns) == 1}
    headers = {name: _told(table, header, name, levels, alone) for name, header in table.columns.items()}
    remarks = [
        remark
        for path, level in levels.items()
        for remark in _of_no_column(path, level, inside[path], has_units=path not in alone)
    ]
    periods = {
        name: Period(*found)
        for name in headers
        if (found := stated_period(*_around(table, name, levels), periods=VARIABLES)) is not None
    }
    table = replace(_without_fills(table, levels), columns=headers, periods=periods)
    remarks += [*_contradictions(table, levels), *decimation_remarks(table)]
    return replace(table, remarks=(*table.remarks, *remarks))


def _groups_of_columns(table: Table) -> list[str]:
    """Return the groups that have columns of a measurement in them, not only what stands beside such columns."""
    found = [
        group
        for name, header in table.columns.items()
        if max(header.shape, default=1) > MOST_NUMBERS
        for group in table.place(name).groups
    ]
    return list(dict.fromkeys(found))


def _columns_of(table: Table, path: str) -> Iterator[_Named]:
    for name, header in table.columns.items():
        if (not path or path in table.place(name).groups) and max(header.shape, default=1) > MOST_NUMBERS:
            yield _Named(name, _own_name(table, name))


def _gathered(table: Table, inside: Mapping[str, Sequence[_Named]]) -> dict[str, dict[str, Any]]:
    """Return the levels of the groups that have columns; what another group has is a table of the one around it."""
    levels = {path: dict(level) for path, level in table.beside.items()}
    while others := [path for path in levels if path not in inside]:
        path = max(others, key=len)
        at = max(path.rfind("/"), path.rfind("."), 0)
        level = levels.pop(path)
        levels.setdefault(path[:at], {}).setdefault(path[at:].lstrip("./"), level)
    return levels


def _expanded(level: Level, columns: Sequence[str], depth: int = 0) -> Iterator[tuple[str, Any]]:
    """Yield keys and values, texts in JSON as the tables that they are, and what such tables have of columns."""
    for key, value in level.items():
        table = _as_table(key, _from_json(value) if isinstance(value, str) else value, columns)
        yield key, table
        if (
            isinstance(table, Mapping)
            and depth < _DEEPEST
            and key not in columns
            and not _is_table_of_columns(key)
        ):
            yield from _expanded(table, columns, depth + 1)


def _is_table_of_columns(key: str) -> bool:
    return is_unit_of_all(key) or is_scale_key(key)


def _as_table(key: str, value: Any, columns: Sequence[str]) -> Any:
    """Return a list as a table: of entries that have names, or of one unit a column, the first of which is the time."""
    if not isinstance(value, list):
        return value
    if value and all(isinstance(one, Mapping) for one in value):
        named = {next((str(one[name]) for name in _NAMES if name in one), ""): one for one in value}
        return {name: one for name, one in named.items() if name} or value
    for names in (columns, columns[1:], [one for one in columns if one not in NO_CHANNELS]):
        if is_unit_of_all(key) and len(names) == len(value) > 1:
            return dict(zip(names, value, strict=True))
    return value


def _from_json(text: str) -> Any:
    if text.lstrip()[:1] not in ("{", "[") or len(text) > _LONGEST_JSON:
        return text
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return text


def _around(table: Table, name: str, levels: Mapping[str, Level]) -> list[Level]:
    """Return the levels around a column, the innermost first."""
    paths = (*reversed(table.place(name).groups), "")
    return [levels[path] for path in paths if path in levels]


def _own_name(table: Table, name: str) -> str:
    """Return a column's name within its innermost group."""
    place = table.place(name)
    return place.within(place.groups[-1]) if place.groups else place.path


def _told(
    table: Table, header: Header, name: str, levels: Mapping[str, Level], alone: Collection[str]
) -> Header:
    """Return a header with what is told around its column; the unit of a group that has it `alone` is its own."""
    own = _own_name(table, name)
    around = _around(table, name, levels)
    unit = header.unit or next((text for level in around if (text := _unit_of(level, own))), None)
    its = [levels[path] for path in table.place(name).groups if path in levels and path in alone]
    unit = unit or next(
        (
            text
            for level in its
            for key, told in level.items()
            if is_unit_of_all(key) and (text := unit_text(told))
        ),
        None,
    )
    scales: dict[str, Any] = {}
    for level in reversed(around):
        scales |= {key: value for key, value in level.items() if is_scale_of(key, own)}
        scales |= dict(_scales_in_tables(level, own))
    unapplied = ", ".join(one for one in (header.unapplied, described_scales(scales)) if one)
    decimation = header.decimation or next((text for one in around if (text := stated_decimation(one))), "")
    return header._replace(unit=unit, unapplied=unapplied, decimation=decimation)


def _scales_in_tables(level: Level, column: str) -> Iterator[tuple[str, Any]]:
    """Yield the scales of a column in tables of a level: `calibration.x`, `calibration.x.gain`, `metadata.x.scale`."""
    for key, value in level.items():
        own = value.get(column) if isinstance(value, Mapping) else None
        if isinstance(own, Mapping):
            yield from ((f"{key}.{column}.{one}", told) for one, told in own.items() if is_own_scale_key(one))
        elif own is not None and is_scale_key(key):
            yield f"{key}.{column}", own


def _unit_of(level: Level, column: str) -> str | None:
    """Return the unit of a column that a level states by the column's name; None: it does not."""
    for key, value in level.items():
        found: str | None = None
        if not isinstance(value, Mapping):
            found = unit_text(value) if is_unit_of(key, column) else None
        elif key == column:
            found = stated_unit(value)
        elif is_unit_of_all(key):
            found = unit_text(value[column]) if column in value else None
        elif isinstance(value.get(column), Mapping):  # an entry a column: `channels`
            found = stated_unit(value[column])
        if found:
            return found
    return None


def _of_no_column(path: str, level: Level, inside: Sequence[_Named], *, has_units: bool) -> Iterator[str]:
    """Yield remarks on units and scales of a group or a file that do not say of which column they are."""
    if not inside:
        return
    where = f'its group "{path}"' if path else "itself"
    scales = {
        key: value
        for key, value in level.items()
        if is_scale_key(key)
        and not isinstance(value, Mapping)
        and not any(is_scale_of(key, one.name) for one in inside)
    }
    if text := described_scales(scales):
        yield (
            f"the file states {text} of {where}, which is not applied; if it scales the numbers of a signal, write "
            "scale and offset into its [signals] table (signal = scale * column + offset)"
        )
    units = [
        f'{key} = "{text}"'
        for key, value in level.items()
        if has_units and is_unit_of_all(key) and (text := unit_text(value))
    ]
    if units:
        yield (
            f"the file states {', '.join(units)} of {where} and not of which column: it is not compared with the "
            "units of the manifest"
        )


def _contradictions(table: Table, levels: Mapping[str, Level]) -> Iterator[str]:
    """Yield remarks on rates around columns that are not theirs, each once."""
    told: set[tuple[float, float]] = set()
    for name, header in table.columns.items():
        for level in _around(table, name, levels) if header.period_s is not None else ():
            found = stated_period(level)
            if found is None or header.period_s is None or abs(found[0] / header.period_s - 1.0) <= _SAME:
                continue
            pair = header.period_s, found[0]
            if pair not in told:
                told.add(pair)
                yield (
                    f'the file states two rates: {1.0 / pair[0]:.6g} Hz for column "{name}" ({header.period_key}), '
                    f"{1.0 / pair[1]:.6g} Hz around it ({found[1]}); the first one counts"
                )


def _without_fills(table: Table, levels: Mapping[str, Level]) -> Table:
    """Return the table with NaN for the numbers that stand beside its columns as those of no reading."""
    fills = {
        name: numbers
        for name in table.columns
        if (numbers := [one for level in _around(table, name, levels) for one in _fills_of(level)])
    }
    if not fills:
        return table

    def load(name: str, first: int, end: int) -> Column:
        values = table.load(name, first, end)
        if name not in fills or values.dtype.kind not in "iuf":
            return values
        readings = values.astype(np.float64)
        readings[np.isin(readings, fills[name])] = np.nan
        return readings

    return replace(table, load=load, load_together=None)


def _fills_of(level: Level) -> Iterator[float]:
    for key, value in level.items():
        if is_fill_key(key) and not isinstance(value, Mapping):
            try:
                yield from (float(one) for one in numbers_of(value) if np.isfinite(one))
            except (ValueError, TypeError):
                continue
