"""Manifest and files -> `Dataset`: columns found, sliced, checked, converted; all findings in one message."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.border.errors import nearest
from rtctl.border.quantities import parse_quantity
from rtctl.measured.columns import FloatArray, TableCache, check_finite
from rtctl.measured.dataset import Dataset, Record
from rtctl.measured.findings import Findings
from rtctl.measured.manifest import Manifest, RecordTable, read_manifest
from rtctl.measured.plant_kinds import PLANT_KINDS, held_unit
from rtctl.measured.time_axis import resampled, resampling_grid, uniform_period
from rtctl.measured.units import convert_column


def read_dataset(path: Path) -> Dataset:
    """The dataset of a `dataset.toml`. Raises InputError with every finding, one a line."""
    manifest = read_manifest(path)
    findings = Findings(str(path))
    reading = _Reading(manifest=manifest, folder=path.parent, cache=TableCache(), findings=findings)
    names = record_names(manifest.records)
    if len(set(names)) < len(names):
        twice = [name for name, count in Counter(names).items() if count > 1]
        findings.add(f'records need different names, "{twice[0]}" appears twice; give each its own name')
    records = [_record(reading, k, names[k]) for k in range(len(manifest.records))]
    if not findings.lines:
        _find_never_measured(reading, [record for record in records if record is not None])
    findings.raise_all()
    tables = manifest.signals
    return Dataset(
        path=path,
        name=manifest.dataset.name,
        plant=manifest.dataset.plant,
        identity=manifest.dataset.identity,
        units={name: reading.unit(name) for name in tables},
        holds={name: table.hold or "linear" for name, table in tables.items() if table.role == "input"},
        records=tuple(record for record in records if record is not None),
    )


def record_names(records: tuple[RecordTable, ...]) -> list[str]:
    """A record's own name, or its file's without suffix; the rows are added where several share a file."""
    stems = [Path(record.file).stem for record in records]
    names = []
    for record, stem in zip(records, stems, strict=True):
        shared = stems.count(stem) > 1 and record.rows is not None
        default = f"{stem}_{record.rows[0]}-{record.rows[1]}" if shared and record.rows else stem
        names.append(record.name or default)
    return names


@dataclass(frozen=True, slots=True, kw_only=True)
class _Reading:
    """What the steps of one reading share."""

    manifest: Manifest
    folder: Path
    cache: TableCache
    findings: Findings

    def unit(self, signal: str) -> str:
        """In which the signal is held."""
        units = {name: table.unit for name, table in self.manifest.signals.items()}
        return held_unit(self.manifest.dataset.plant, signal, units)

    def is_optional(self, signal: str) -> bool:
        """Whether a record may lack the signal."""
        return PLANT_KINDS[self.manifest.dataset.plant].signals[signal].optional


def _record(reading: _Reading, k: int, name: str) -> Record | None:
    """One record, or None with findings."""
    entry = reading.manifest.records[k]
    findings, where = reading.findings, f'records.{k} "{entry.file}"'
    before = len(findings.lines)
    with findings.under(where):
        reading.cache.table(reading.folder / entry.file)
    if len(findings.lines) > before:
        return None
    columns = _columns(reading, entry, where)
    initial = _initial(reading, entry, where)
    if len(findings.lines) > before:
        return None
    with findings.under(where):
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


def _columns(reading: _Reading, entry: RecordTable, where: str) -> dict[str, FloatArray]:
    """Sliced, finite columns in held units by signal; the time column under its own name."""
    columns: dict[str, FloatArray] = {}
    path = reading.folder / entry.file
    for name, table in reading.manifest.signals.items():
        column = table.column or name
        if reading.is_optional(name) and column not in reading.cache.table(path).columns:
            continue
        with reading.findings.under(where):
            values = _slice(reading.cache.column(path, column, table.unit), entry)
            if reading.is_optional(name) and np.isnan(values).all():
                continue  # an instrument that was not there
            check_finite(values, column, entry.first_row)
            columns[name] = convert_column(values, table.unit, reading.unit(name))
    if entry.time is not None:
        with reading.findings.under(f"{where}, key time"):
            values = _slice(reading.cache.column(path, entry.time, "s"), entry)
            check_finite(values, entry.time, entry.first_row)
            columns[_TIME] = values
    return columns


_TIME = "[time]"  # no signal's name: those come from the kinds of plants


def _slice(values: FloatArray, entry: RecordTable) -> FloatArray:
    if len(values) == 0:
        raise ValueError("the file has no rows")
    if entry.rows is None:
        return values
    first, end = entry.rows
    if end > len(values):
        raise ValueError(f"rows = [{first}, {end}] ends after the file's {len(values)} rows")
    return values[first:end]


def _on_time_base(
    reading: _Reading, entry: RecordTable, columns: Mapping[str, FloatArray]
) -> tuple[float, dict[str, FloatArray]]:
    """Period [s] and the signals on it. Raises ValueError in words."""
    signals = {name: values for name, values in columns.items() if name != _TIME}
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) != 1:
        raise ValueError(
            "columns differ in length: " + ", ".join(f"{name} {n}" for name, n in lengths.items())
        )
    if min(lengths.values()) < 2:
        raise ValueError("a record needs at least 2 samples, got 1")
    if entry.sample_rate_hz is not None or entry.time is None:
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


def _initial(reading: _Reading, entry: RecordTable, where: str) -> dict[str, float]:
    """`initial` in held units: a quantity, or a number in the unit that the manifest gives the signal."""
    plant, tables = reading.manifest.dataset.plant, reading.manifest.signals
    known = PLANT_KINDS[plant].initial
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


def _find_never_measured(reading: _Reading, records: list[Record]) -> None:
    """A declared signal that no record has is a misspelt column, not a missing instrument."""
    for name, table in reading.manifest.signals.items():
        if not any(record.has(name) for record in records):
            column = table.column or name
            available = {
                other
                for entry in reading.manifest.records
                for other in reading.cache.table(reading.folder / entry.file).columns
            }
            reading.findings.add(
                f'signals.{name}: no record has numbers in a column "{column}"'
                f"{nearest(column, available)}; correct column, or remove [signals.{name}]"
            )
