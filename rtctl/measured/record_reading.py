"""Read one `[[records]]` table to one `Record`: first the checks without the numbers, then the numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import nearest
from rtctl.border.quantities import parse_quantity
from rtctl.measured.columns.conversion import TableCache, check_finite
from rtctl.measured.columns.time_axis import (
    check_stated_period,
    resampled,
    resampling_grid,
    uniform_period,
)
from rtctl.measured.dataset import Record
from rtctl.measured.manifest.findings import Findings
from rtctl.measured.manifest.schema import Manifest, RecordTable
from rtctl.measured.manifest.signal_kinds import held_unit
from rtctl.measured.units import convert_column
from rtctl.registry import plant_kind

_TIME = "[time]"  # no signal's name: those come from the kinds of plants


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """Shared state of the steps of one reading."""

    manifest: Manifest
    folder: Path
    cache: TableCache
    findings: Findings

    def unit(self, signal: str) -> str:
        """Return the unit in which the signal is held."""
        units = {name: table.unit for name, table in self.manifest.signals.items()}
        return held_unit(self.manifest.dataset.plant, signal, units)

    def is_optional(self, signal: str) -> bool:
        """Return whether a record may lack the signal: not the first response that the manifest has."""
        kind = plant_kind(self.manifest.dataset.plant)
        responses = [name for name in kind.responses if name in self.manifest.signals]
        return kind.signals[signal].optional and signal not in responses[:1]

    def present(self, entry: RecordTable) -> dict[str, str]:
        """Return the column of each signal that the record's file has to have, or has."""
        columns = self.cache.table(self.folder / entry.file).columns
        named = {name: table.column or name for name, table in self.manifest.signals.items()}
        return {
            name: column for name, column in named.items() if column in columns or not self.is_optional(name)
        }

    def where(self, k: int) -> str:
        """Return the record's place in the manifest, for messages."""
        return f'records.{k} "{self.manifest.records[k].file}"'


def check_record(reading: Reading, k: int) -> bool:
    """Return whether a record passes the checks that need no numbers.

    Findings are about its file, columns, units, lengths and state.
    """
    entry, where = reading.manifest.records[k], reading.where(k)
    path, findings = reading.folder / entry.file, reading.findings
    before = len(findings.lines)
    with findings.under(where):
        reading.cache.table(path)
    _initial(reading, entry, where)
    if path not in reading.cache:
        return False
    lengths: dict[str, int] = {}
    for name, column in reading.present(entry).items():
        with findings.under(where):
            unit = reading.manifest.signals[name].unit
            lengths[name] = _selected(reading.cache.length(path, column, unit), entry)
            if entry.sample_rate_hz is not None:
                stated = reading.cache.period_s(path, column)
                check_stated_period(stated, column, entry.sample_rate_hz)
    if entry.time is not None:
        with findings.under(f"{where}, key time"):
            lengths["time"] = _selected(reading.cache.length(path, entry.time, "s"), entry)
    if len(findings.lines) == before:
        with findings.under(where):
            _check_lengths(lengths, entry)
    return len(findings.lines) == before


def read_record(reading: Reading, k: int, name: str) -> Record | None:
    """Return a record that `check_record` accepted, or None with findings about its numbers."""
    entry, where = reading.manifest.records[k], reading.where(k)
    before = len(reading.findings.lines)
    columns = _columns(reading, entry, where)
    initial = _initial(reading, entry, where)
    if len(reading.findings.lines) > before:
        return None
    with reading.findings.under(where):
        period_s, signals = _on_time_base(reading, entry, columns)
        return Record(
            name=name,
            file=entry.file,
            period_s=period_s,
            use=entry.use,
            signals=signals,
            ignore_first=entry.ignore_first,
            repeat=entry.repeat,
            conditions={**reading.manifest.dataset.conditions, **entry.conditions},
            initial=initial,
        )
    return None


def _selected(samples: int, entry: RecordTable) -> int:
    """Return how many of a column's `samples` the record takes. Raises ValueError in words."""
    if samples == 0:
        raise ValueError("the file has no rows")
    if entry.rows is None:
        return samples
    first, end = entry.rows
    if end > samples:
        raise ValueError(f"rows = [{first}, {end}] ends after the file's {samples} rows")
    return end - first


def _check_lengths(lengths: Mapping[str, int], entry: RecordTable) -> None:
    if len(set(lengths.values())) != 1:
        raise ValueError(
            "columns differ in length: " + ", ".join(f"{name} {n}" for name, n in lengths.items())
        )
    samples = min(lengths.values())
    if samples < 2:
        raise ValueError("a record needs at least 2 samples, got 1")
    if entry.ignore_first >= samples and not entry.resample:
        raise ValueError(
            f"ignore_first = {entry.ignore_first} leaves nothing of {samples} samples; "
            f"it must be below {samples}"
        )


def _columns(reading: Reading, entry: RecordTable, where: str) -> dict[str, FloatArray]:
    """Return finite columns in held units by signal, only the rows of the record; time under its own name."""
    columns: dict[str, FloatArray] = {}
    path, cache = reading.folder / entry.file, reading.cache
    first, end = entry.rows or (0, None)
    for name, column in reading.present(entry).items():
        unit = reading.manifest.signals[name].unit
        with reading.findings.under(where):
            values = cache.column(path, column, unit, first, end)
            if reading.is_optional(name) and np.isnan(values).all():
                continue  # an instrument that was not there
            check_finite(values, column, first)
            columns[name] = convert_column(values, unit, reading.unit(name))
    if entry.time is not None:
        with reading.findings.under(f"{where}, key time"):
            columns[_TIME] = cache.column(path, entry.time, "s", first, end)
            check_finite(columns[_TIME], entry.time, first)
    return columns


def _on_time_base(
    reading: Reading, entry: RecordTable, columns: Mapping[str, FloatArray]
) -> tuple[float, dict[str, FloatArray]]:
    """Return the period [s] and the signals on it. Raises ValueError in words."""
    signals = {name: values for name, values in columns.items() if name != _TIME}
    if entry.time is None or entry.sample_rate_hz is not None:
        return 1.0 / (entry.sample_rate_hz or 1.0), signals
    time_s, first = columns[_TIME], entry.first_row
    if not entry.resample:
        return uniform_period(time_s, entry.time, first), signals
    grid = resampling_grid(time_s, entry.time, first)
    tables = reading.manifest.signals
    moved = {
        name: resampled(values, time_s, grid, held=tables[name].hold == "zero")
        for name, values in signals.items()
    }
    return float(grid[1] - grid[0]), moved


def _initial(reading: Reading, entry: RecordTable, where: str) -> dict[str, float]:
    """Return `initial` in held units: a quantity, or a number in the unit that the manifest gives the signal."""
    plant, tables = reading.manifest.dataset.plant, reading.manifest.signals
    known = plant_kind(plant).initial
    state: dict[str, float] = {}
    for key, raw in entry.initial.items():
        if key not in known:
            reading.findings.add(
                f'{where}: unknown key "initial.{key}" of a plant "{plant}"'
                f"{nearest(key, known) or '; it starts on the branch that a full cooling leaves'}"
            )
            continue
        with reading.findings.under(f"{where}, key initial.{key}"):
            state[key] = _initial_value(raw, reading.unit(key), tables[key].unit if key in tables else None)
    return state


def _initial_value(raw: Any, held: str, written: str | None) -> float:
    if isinstance(raw, int | float) and not isinstance(raw, bool):
        raw = {"value": raw, "unit": written or held}
    value = parse_quantity(raw, held)
    if not np.isfinite(value):
        raise ValueError(f"must be finite, got {value!r} {held}")
    return value
