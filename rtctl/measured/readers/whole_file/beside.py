"""Units, scales and rates that a file states beside its columns: in a group, in the file, in variables of its own.

`x_unit = "um"` of a group; a table `units` (a struct of MATLAB, a JSON text of Parquet, pandas' attributes); an entry
of the column's own name that has its unit. A scale or a unit that does not say of which column is told, not applied.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from rtctl.measured.readers.stated.attributes import described_scales, stated_unit, unit_text
from rtctl.measured.readers.stated.beside import Level, Period
from rtctl.measured.readers.stated.keys import is_scale_key, is_scale_of, is_unit_of, is_unit_of_all
from rtctl.measured.readers.stated.rate import stated_period
from rtctl.measured.readers.table import Header, Table

_DEEPEST = 2
"""Tables within tables that are looked into."""
_LONGEST_JSON = 20_000


def with_beside(table: Table) -> Table:
    """Return a table whose columns have the units that stand beside them; scales and other units there are remarks."""
    if not table.beside:
        return table
    levels = {path: dict(_expanded(level)) for path, level in table.beside.items()}
    headers = {name: _told(table, header, name, levels) for name, header in table.columns.items()}
    periods = {
        name: Period(*found)
        for name in headers
        if (found := stated_period(*_around(table, name, levels))) is not None
    }
    remarks = [remark for path, level in levels.items() for remark in _of_no_column(table, path, level)]
    return replace(table, columns=headers, remarks=(*table.remarks, *remarks), periods=periods)


def _expanded(level: Level, depth: int = 0) -> Iterator[tuple[str, Any]]:
    """Yield keys and values, texts in JSON as the tables that they are, and what such tables have of columns."""
    for key, value in level.items():
        table = _json_table(value) if isinstance(value, str) else value
        if not isinstance(table, Mapping):
            yield key, value
            continue
        yield key, table
        if depth < _DEEPEST and not is_unit_of_all(key):
            yield from _expanded(table, depth + 1)


def _json_table(text: str) -> Any:
    if not text.lstrip().startswith("{") or len(text) > _LONGEST_JSON:
        return None
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None


def _around(table: Table, name: str, levels: Mapping[str, Level]) -> list[Level]:
    """Return the levels around a column, the innermost first."""
    paths = (*reversed(table.place(name).groups), "")
    return [levels[path] for path in paths if path in levels]


def _own_name(table: Table, name: str) -> str:
    """Return a column's name within its innermost group."""
    place = table.place(name)
    return place.within(place.groups[-1]) if place.groups else place.path


def _told(table: Table, header: Header, name: str, levels: Mapping[str, Level]) -> Header:
    own = _own_name(table, name)
    around = _around(table, name, levels)
    unit = header.unit or next((text for level in around if (text := _unit_of(level, own))), None)
    scales = described_scales({
        key: value for level in reversed(around) for key, value in level.items() if is_scale_of(key, own)
    })  # fmt: skip
    unapplied = ", ".join(one for one in (header.unapplied, scales) if one)
    return header._replace(unit=unit, unapplied=unapplied)


def _unit_of(level: Level, column: str) -> str | None:
    """Return the unit of a column that a level states by the column's name; None: it does not."""
    for key, value in level.items():
        if isinstance(value, Mapping):
            own = value.get(column)
            if key == column:
                found = stated_unit(value)
            elif is_unit_of_all(key):
                found = unit_text(own) if own is not None else None
            else:
                found = None
        else:
            found = unit_text(value) if is_unit_of(key, column) else None
        if found:
            return found
    return None


def _of_no_column(table: Table, path: str, level: Level) -> Iterator[str]:
    """Yield remarks on units and scales of a group or a file that do not say of which column they are."""
    inside = [name for name in table.columns if not path or path in table.place(name).groups]
    names = [_own_name(table, name) for name in inside]
    where = f'its group "{path}"' if path else "itself"
    scales = {
        key: value
        for key, value in level.items()
        if is_scale_key(key)
        and not isinstance(value, Mapping)
        and not any(is_scale_of(key, name) for name in names)
    }
    if inside and (text := described_scales(scales)):
        yield (
            f"the file states {text} of {where}, which is not applied; if it scales the numbers of a signal, write "
            "scale and offset into its [signals] table (signal = scale * column + offset)"
        )
    units = [
        f'{key} = "{text}"'
        for key, value in level.items()
        if is_unit_of_all(key) and (text := unit_text(value))
    ]
    if inside and units:
        yield (
            f"the file states {', '.join(units)} of {where} and not of which column: it is not compared with the "
            "units of the manifest"
        )
