"""Read one `[[records]]` table to one `Record`: first the checks without the numbers, then the numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.units.quantities import QUANTITY
from rtctl.measured.columns.alignment import check_one_acquisition, describe_leads, leading_rows
from rtctl.measured.columns.conversion import TableCache, check_finite
from rtctl.measured.columns.outliers import describe_far_readings
from rtctl.measured.columns.time_axis import (
    check_stated_period,
    resampled,
    resampling_grid,
    straightened,
    uniform_period,
)
from rtctl.measured.columns.time_column import (
    TimeColumn,
    TimeUnit,
    choose_time_unit,
    remark_on_period,
    seconds,
)
from rtctl.measured.dataset import Record
from rtctl.measured.manifest.findings import Findings
from rtctl.measured.manifest.schema import Manifest, RecordTable
from rtctl.measured.manifest.signal_kinds import held_name, held_unit
from rtctl.measured.readers.table import Header
from rtctl.measured.records.initial_state import read_initial_state
from rtctl.measured.units import convert_column
from rtctl.registry import plant_kind


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

    def held_name(self, signal: str) -> str:
        """Return the name under which the signal is held."""
        return held_name(self.manifest.dataset.plant, signal)

    def is_optional(self, signal: str) -> bool:
        """Return whether a record may lack the signal: not the first response that the manifest has."""
        kind = plant_kind(self.manifest.dataset.plant)
        responses = [name for name in kind.responses if name in self.manifest.signals]
        known = kind.signal(signal, self.manifest.signals[signal].role)
        return known is not None and known.optional and signal not in responses[:1]

    def present(self, entry: RecordTable) -> dict[str, str]:
        """Return the column of each signal that the record's file has to have, or has."""
        known = self.cache.names(self.folder / entry.file, entry.group)
        named = {
            name: table.parts[0] if table.parts else table.column or name
            for name, table in self.manifest.signals.items()
            if table.constant is None
        }
        return {
            name: self.column(entry, column)
            for name, column in named.items()
            if column in known or not self.is_optional(name)
        }

    def column(self, entry: RecordTable, name: str) -> str:
        """Return the column of the file that has a name in the record's group."""
        return self.cache.named(self.folder / entry.file, entry.group, name)

    def time_column(self, entry: RecordTable) -> str | None:
        """Return the column of the record's time; None: it has none."""
        return None if entry.time is None else self.column(entry, entry.time)

    def opens(self, entry: RecordTable, where: str) -> bool:
        """Return whether the record's file can be read and has its group; what is wrong becomes a finding."""
        path = self.folder / entry.file
        before = len(self.findings.lines)
        with self.findings.under(where):
            for remark in self.cache.table(path).remarks:
                self.findings.remark(f"{entry.file}: {remark}")  # of the file: once for all of its records
            self.cache.names(path, entry.group)
        return len(self.findings.lines) == before

    def file_unit(self, signal: str) -> str | None:
        """Return the unit that the signal's column should have; None: it holds counts, which the manifest scales."""
        table = self.manifest.signals[signal]
        return None if table.counts else table.unit

    def headers(self, entry: RecordTable) -> dict[str, Header]:
        """Return the headers of the record's signals, by column."""
        path = self.folder / entry.file
        return {column: self.cache.header(path, column) for column in self.present(entry).values()}

    def where(self, k: int) -> str:
        """Return the record's place in the manifest, for messages."""
        entry = self.manifest.records[k]
        group = "" if entry.group is None else f' group "{entry.group}"'
        return f'records.{k} "{entry.file}"{group}'


def check_record(reading: Reading, k: int) -> bool:
    """Return whether a record passes the checks that need no numbers.

    Findings are about its file, columns, units, lengths and state.
    """
    entry, where = reading.manifest.records[k], reading.where(k)
    findings = reading.findings
    before = len(findings.lines)
    opened = reading.opens(entry, where)
    read_initial_state(reading.manifest, entry, where, findings)
    if not opened:
        return False
    lengths = _checked_lengths(reading, entry, where)
    if len(findings.lines) == before:
        with findings.under(where):
            _check_lengths(lengths, entry)
    return len(findings.lines) == before


def read_record(reading: Reading, k: int, name: str) -> Record | None:
    """Return a record that `check_record` accepted, or None with findings about its numbers."""
    entry, where = reading.manifest.records[k], reading.where(k)
    before = len(reading.findings.lines)
    columns, time = _columns(reading, entry, where)
    initial = read_initial_state(reading.manifest, entry, where, reading.findings)
    if len(reading.findings.lines) > before:
        return None
    with reading.findings.under(where):
        period_s, signals = _on_time_base(reading, entry, columns, time)
        if time is not None and entry.time is not None and not time.of_dates:
            unit = _time_unit(reading, entry)
            span_s = float(time.time_s[-1] - time.time_s[0])
            if remark := remark_on_period(period_s, span_s, unit, reading.time_column(entry) or ""):
                reading.findings.remark(remark if unit.source else f"{where}: {remark}")  # once for all files
        return Record(
            name=name,
            file=entry.file,
            group=entry.group,
            period_s=period_s,
            use=entry.use,
            signals=_with_constants(reading, signals),
            ignore_first=entry.ignore_first,
            repeat=entry.repeat,
            conditions={**reading.manifest.dataset.conditions, **entry.conditions},
            initial=initial,
        )
    return None


def _with_constants(reading: Reading, measured: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Return the measured signals and inputs that no column has, under the names and in the order of the manifest."""
    samples = len(next(iter(measured.values())))
    found = {}
    for name, table in reading.manifest.signals.items():
        if table.constant is not None:
            values = np.full(samples, table.constant)
            found[reading.held_name(name)] = convert_column(values, table.unit, reading.unit(name))
        elif name in measured:
            found[reading.held_name(name)] = measured[name]
    return found


def _checked_lengths(reading: Reading, entry: RecordTable, where: str) -> dict[str, int]:
    """Return the samples that the record takes of each signal and of time; what is wrong becomes findings."""
    path, cache, findings = reading.folder / entry.file, reading.cache, reading.findings
    whole: dict[str, int] = {}
    for name, column in reading.present(entry).items():
        with findings.under(where):
            unit = reading.file_unit(name)
            whole[name] = cache.length(path, column, unit)
            for remark in cache.remarks(path, column, unit):
                findings.remark(f"{where}: {remark}")
            if unit is not None and (stated := cache.header(path, column).unapplied):
                findings.remark(_unapplied(name, reading.manifest.signals[name].column or name, stated))
    lengths: dict[str, int] = {}
    if len(whole) == len(reading.present(entry)):
        with findings.under(where):
            lengths = {
                name: _selected(count, entry)
                for name, count in _aligned(reading, entry, whole, where).items()
            }
    if entry.time is not None:
        with findings.under(f"{where}, key time"):
            _time_unit(reading, entry)
            lengths["time"] = _selected(cache.rows(path, reading.column(entry, entry.time)), entry)
    return lengths


def _unapplied(signal: str, column: str, stated: str) -> str:
    """Return the remark on a scale that the file states and that nobody applies: once for all records of a signal."""
    value = stated.partition(" = ")[2]
    option = value if QUANTITY.fullmatch(value) and "/" in value else "NUMBER UNIT"
    return (
        f'signals.{signal}: column "{column}": the file states {stated}, which is not applied; if it scales the '
        f"numbers, write scale and offset, and the unit that they lead to, into [signals.{signal}] (signal = scale * "
        f"column + offset), or let rtctl init write them: --scale '{signal}={option}'"
    )


def _aligned(reading: Reading, entry: RecordTable, whole: Mapping[str, int], where: str) -> dict[str, int]:
    """Return the samples of each signal from the first instant that all have. Raises ValueError in words."""
    columns = reading.present(entry)
    headers = reading.headers(entry)
    if entry.time is not None:
        starts = {one.start_s for one in headers.values() if one.start_s is not None}
        if len(starts) > 1:
            raise ValueError(
                f'the columns begin at different times, which one time column "{entry.time}" cannot tell; remove time, '
                "and give sample_rate_hz"
            )
        return dict(whole)
    check_one_acquisition(headers, entry.rows)
    leads = leading_rows(headers, stated_period(reading, entry))
    if not any(leads.values()):
        return dict(whole)
    reading.findings.remark(f"{where}: {describe_leads(leads, headers)}")
    left = {name: samples - leads[columns[name]] for name, samples in whole.items()}
    return dict.fromkeys(left, max(min(left.values()), 0))


def stated_period(reading: Reading, entry: RecordTable) -> float:
    """Return the sample period [s] of a record without a time column: the manifest's, or that of its file.

    Raises:
        ValueError: Neither states one, or they state different ones.
    """
    path, rate = reading.folder / entry.file, entry.sample_rate_hz
    other = ""
    for column in reading.present(entry).values():
        stated = reading.cache.period_s(path, column)
        if rate is None and stated is not None:
            rate, other = 1.0 / stated.period_s, f'column "{column}"'
        elif rate is not None:
            _remark_once(reading, check_stated_period(stated, column, rate, other))
    if rate is None:
        doubt = reading.cache.table(path).preamble.doubt
        raise ValueError(
            f"no sample rate{f', as {doubt}' if doubt else ''}: add sample_rate_hz = <Hz>, or time = <column in "
            "seconds>"
        )
    return 1.0 / rate


def _remark_once(reading: Reading, remark: str) -> None:
    if remark:
        reading.findings.remark(remark)


def _time_unit(reading: Reading, entry: RecordTable) -> TimeUnit:
    """Return the unit of the record's time column. Raises ValueError where file and manifest differ."""
    name = reading.time_column(entry) or ""
    stated = reading.cache.stated_unit(reading.folder / entry.file, name)
    return choose_time_unit(entry.time_unit, stated, name)


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


def _columns(
    reading: Reading, entry: RecordTable, where: str
) -> tuple[dict[str, FloatArray], TimeColumn | None]:
    """Return finite columns in held units by signal, only the rows of the record; and its time column."""
    columns: dict[str, FloatArray] = {}
    path, cache = reading.folder / entry.file, reading.cache
    rows = _rows_of_columns(reading, entry)
    for name, column in reading.present(entry).items():
        table = reading.manifest.signals[name]
        first, end = rows[column]
        with reading.findings.under(where):
            values = cache.column(path, column, reading.file_unit(name), first, end)
            if reading.is_optional(name) and np.isnan(values).all():
                continue  # an instrument that was not there
            check_finite(values, column, first)
            if table.counts:
                values = (1.0 if table.scale is None else table.scale) * values + (table.offset or 0.0)
                if remark := _below_zero(values, table.unit, table.offset):
                    reading.findings.remark(f"signals.{name}: {remark}")
            if remark := describe_far_readings(
                values, column, table.unit, first, is_input=table.role == "input"
            ):
                reading.findings.remark(f"{where}: {remark}")
            columns[name] = convert_column(values, table.unit, reading.unit(name))
    if entry.time is None:
        return columns, None
    with reading.findings.under(f"{where}, key time"):
        first, last = entry.rows or (0, None)
        name = reading.column(entry, entry.time)
        raw = cache.raw(path, name, first, last)
        return columns, seconds(raw, _time_unit(reading, entry), name, first)
    return columns, None


def _below_zero(values: FloatArray, unit: str, offset: float | None) -> str:
    """Return a remark on a temperature that its offset leads below absolute zero; "" where it does not."""
    if offset is None or unit != "K" or not float(values.min()) < 0.0:
        return ""
    return f"offset = {offset:g} leads to temperatures below 0 K: of a column in degC it is 273.15, with its sign"


def _rows_of_columns(reading: Reading, entry: RecordTable) -> dict[str, tuple[int, int | None]]:
    """Return the rows of the file [first, end) of each column, aligned where they begin at different times."""
    first, end = entry.rows or (0, None)
    headers = reading.headers(entry)
    leads = leading_rows(headers, stated_period(reading, entry)) if entry.time is None else {}
    if not any(leads.values()):
        return dict.fromkeys(headers, (first, end))
    common = min(reading.cache.rows(reading.folder / entry.file, name) - lead for name, lead in leads.items())
    end = common if end is None else end
    return {name: (first + lead, end + lead) for name, lead in leads.items()}


def _on_time_base(
    reading: Reading, entry: RecordTable, signals: dict[str, FloatArray], time: TimeColumn | None
) -> tuple[float, dict[str, FloatArray]]:
    """Return the period [s] and the signals on it. Raises ValueError in words."""
    name = reading.time_column(entry)
    if time is None or name is None:
        return stated_period(reading, entry), signals
    first = entry.first_row
    if not entry.resample:
        period_s = uniform_period(time.time_s, name, first, time.resolution_s)
        axis = f'time column "{name}"{f" in {entry.time_unit}" if entry.time_unit else ""}'
        for column in reading.present(entry).values():
            stated = reading.cache.period_s(reading.folder / entry.file, column)
            _remark_once(reading, check_stated_period(stated, column, 1.0 / period_s, axis))
        return period_s, signals
    instants_s = straightened(time.time_s, name, first, time.resolution_s)
    grid = resampling_grid(instants_s, name, first)
    tables = reading.manifest.signals
    moved = {
        signal: resampled(values, instants_s, grid, held=tables[signal].hold == "zero")
        for signal, values in signals.items()
    }
    return float(grid[1] - grid[0]), moved
