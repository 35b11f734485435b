"""The one in-memory form of measured data, and the reading of it from a manifest.

Row k holds the input that is applied from t_k to t_{k+1} (under hold "zero") and the outputs measured at t_k, before
this row's input takes effect.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rtctl.border.errors import InputError
from rtctl.border.quantities import check, convert, read_toml
from rtctl.measured.manifest import SIGNALS_OF, Manifest, RecordTable, Signal
from rtctl.measured.readers import read_table

FloatArray = NDArray[np.float64]
UNIFORMITY = 1e-3  # of the period


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """One recording; all signals have the same length."""

    name: str
    period_s: float
    use: Literal["identify", "fit", "test"]
    signals: Mapping[str, FloatArray]
    """By name, (rows,), in the units of the dataset."""
    ignore_first: int = 0
    repeat: str | None = None
    initial: Mapping[str, Any] = field(default_factory=dict)
    conditions: Mapping[str, Any] = field(default_factory=dict)

    def has(self, name: str) -> bool:
        """Whether this record has the signal."""
        return name in self.signals


@dataclass(frozen=True, slots=True, kw_only=True)
class Dataset:
    """All records of a manifest."""

    path: Path
    name: str
    plant: Literal["oscillator", "vo2"]
    identity: str
    units: Mapping[str, str]
    holds: Mapping[str, str]
    """Of the inputs, between samples."""
    records: tuple[Record, ...]


def read_dataset(path: Path) -> Dataset:
    """Read a manifest and its files. Raises InputError with every finding of the manifest, then of the first file."""
    manifest = check(Manifest, read_toml(path), str(path))
    plant = manifest.dataset.plant
    units = {name: SIGNALS_OF[plant][name][1] or signal.unit for name, signal in manifest.signals.items()}
    records = tuple(_read_record(path, manifest, table, units) for table in manifest.records)
    holds = {name: s.hold or "linear" for name, s in manifest.signals.items() if s.role == "input"}
    return Dataset(
        path=path,
        name=manifest.dataset.name,
        plant=plant,
        identity=manifest.dataset.identity,
        units=units,
        holds=holds,
        records=records,
    )


def _read_record(path: Path, manifest: Manifest, table: RecordTable, units: Mapping[str, str]) -> Record:
    file = path.parent / table.file
    columns = {name: signal.column or name for name, signal in manifest.signals.items()}
    if manifest.dataset.plant == "vo2" and not _has_column(file, columns.get("deflection")):
        columns.pop("deflection", None)  # the external instrument may be missing in a record
    wanted = list(columns.values()) + ([table.time] if table.time else [])
    raw = _slice(file, table, read_table(file, wanted))
    period_s = 1.0 / table.sample_rate_hz if table.sample_rate_hz else 0.0
    if table.time is not None:
        period_s, raw = _uniform(file, table, raw)
    signals = {name: _converted(file, manifest.signals[name], raw[column], column, units[name])
               for name, column in columns.items()}  # fmt: skip
    rows = len(next(iter(signals.values())))
    if table.ignore_first >= rows:
        raise InputError(f"{file}: ignore_first = {table.ignore_first} leaves nothing of {rows} rows")
    return Record(
        name=table.file,
        period_s=period_s,
        use=table.use,
        signals=signals,
        ignore_first=table.ignore_first,
        repeat=table.repeat,
        initial=table.initial,
        conditions=table.conditions,
    )


def _has_column(file: Path, column: str | None) -> bool:
    if column is None:
        return False
    try:
        read_table(file, [column])
    except InputError:
        return False
    return True


def _slice(file: Path, table: RecordTable, raw: dict[str, FloatArray]) -> dict[str, FloatArray]:
    lengths = {len(values) for values in raw.values()}
    if len(lengths) > 1:
        raise InputError(f"{file}: columns of different lengths: {({n: len(v) for n, v in raw.items()})}")
    if table.rows is None:
        return raw
    first, last = table.rows
    if last > max(lengths):
        raise InputError(f"{file}: rows = [{first}, {last}], the file has {max(lengths)} rows")
    return {name: values[first:last] for name, values in raw.items()}


def _uniform(file: Path, table: RecordTable, raw: dict[str, FloatArray]) -> tuple[float, dict[str, FloatArray]]:
    time_s = raw[table.time or ""]
    steps = np.diff(time_s)
    if len(steps) == 0 or not np.isfinite(time_s).all() or not (steps > 0.0).all():
        where = int(np.argmin(steps > 0.0)) + 1 if len(steps) else 0
        raise InputError(f'{file}: time column "{table.time}" must rise from row to row; it does not at row {where}')
    period_s = float(time_s[-1] - time_s[0]) / len(steps)
    off = np.abs(time_s - (time_s[0] + period_s * np.arange(len(time_s)))) / period_s
    worst = int(np.argmax(np.maximum(off[1:], np.abs(steps / period_s - 1.0)))) + 1
    deviation = float(abs(steps[worst - 1] / period_s - 1.0))
    if deviation <= UNIFORMITY:
        return period_s, raw
    if not table.resample:
        raise InputError(
            f'{file}: time column "{table.time}" is not uniform: row {worst} comes {steps[worst - 1]:.6g} s after the '
            f"one before, the mean step is {period_s:.6g} s (limit 0.1 %); set resample = true to interpolate"
        )
    grid = time_s[0] + period_s * np.arange(len(time_s))
    return period_s, {name: np.interp(grid, time_s, values) for name, values in raw.items()}


def _converted(file: Path, signal: Signal, values: FloatArray, column: str, unit: str) -> FloatArray:
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        rows = ", ".join(str(row) for row in bad[:5]) + (", ..." if len(bad) > 5 else "")
        raise InputError(
            f'{file}: column "{column}" has {len(bad)} values that are no finite numbers (rows {rows}); '
            "cut them off with rows = [first, last] or repair the file"
        )
    factor = convert(1.0, signal.unit, unit)
    offset = convert(0.0, signal.unit, unit)
    return values * (factor - offset) + offset
