"""Read one `[[records]]` table with a column of frequencies: a lock-in sweep or a frequency response function.

The complex amplitude of a response is in_phase + i quadrature, or amplitude e^(i phase): the response is
Re(amplitude e^(2 pi i f t)) to a drive of drive_amplitude cos(2 pi f t), so a response that lags has a negative phase.
RMS and peak-to-peak values and decibels become peak values here, at the border.
"""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.measured.amplitude_unit import AmplitudeUnit
from rtctl.measured.columns.conversion import check_finite, rows_text
from rtctl.measured.dataset import FREQUENCY, SWEEP_PERIOD_S, Record
from rtctl.measured.manifest.schema import RecordTable, SignalTable
from rtctl.measured.records.record_reading import Reading
from rtctl.measured.stated_unit import column_amplitude, converted_amplitude, told_amplitude
from rtctl.measured.units import convert_column, convert_frequency
from rtctl.registry import plant_kind

LEAST_ROWS = 5
"""Rows below which a sweep is no sweep."""
NO_AMPLITUDE = (
    "the amplitude of the {drive} is nowhere: add drive_amplitude = <{unit}> to the record, or a column "
    '"{column}"'
)
UNKNOWN_AMPLITUDE = (
    "the amplitude of the {drive} is not given, and the response is given per drive: it is taken as 1 {unit}. Linear "
    "parameters do not depend on it; add drive_amplitude where anything nonlinear is asked"
)


def check_sweep(reading: Reading, k: int) -> bool:
    """Return whether a sweep passes the checks that need no numbers: file, columns, units, lengths."""
    entry, where, findings = reading.manifest.records[k], reading.where(k), reading.findings
    path, cache = reading.folder / entry.file, reading.cache
    before = len(findings.lines)
    with findings.under(where):
        _check_plant(reading)
    if not reading.opens(entry, where) or len(findings.lines) > before:
        return False
    lengths = {}
    for column, table in _columns(reading, entry).items():
        with findings.under(where):
            unit, _ = _unit_of(reading, entry, table, column)
            lengths[column] = cache.length(path, reading.column(entry, column), unit)
    with findings.under(where):
        _check_amplitude(reading, entry)
    if len(findings.lines) > before:
        return False
    with findings.under(where):
        _check_lengths(lengths, entry)
    return len(findings.lines) == before


def read_sweep(reading: Reading, k: int, name: str) -> Record | None:
    """Return a sweep that `check_sweep` accepted, or None with findings about its numbers."""
    entry, where = reading.manifest.records[k], reading.where(k)
    signals: dict[str, FloatArray] = {}
    before = len(reading.findings.lines)
    with reading.findings.under(where):
        signals[FREQUENCY] = np.repeat(_frequencies(reading, entry), 2)
    for signal, table in reading.manifest.signals.items():
        with reading.findings.under(where):
            if table.role == "input":
                signals[reading.held_name(signal)] = np.repeat(_amplitudes(reading, entry, signal), 2)
    if len(reading.findings.lines) > before:
        return None
    for signal, table in reading.manifest.signals.items():
        with reading.findings.under(where):
            if (
                table.role == "output"
                and reading.column(entry, table.parts[0]) in reading.present(entry).values()
            ):
                signals[reading.held_name(signal)] = _response(reading, entry, signal, signals["drive"])
    if len(reading.findings.lines) > before:
        return None
    return Record(
        name=name,
        file=entry.file,
        group=entry.group,
        period_s=SWEEP_PERIOD_S,
        use=entry.use,
        signals=signals,
        repeat=entry.repeat,
        conditions={**reading.manifest.dataset.conditions, **entry.conditions},
    )


def _check_plant(reading: Reading) -> None:
    """Raise ValueError where a dataset cannot have sweeps."""
    heading = reading.manifest.dataset
    if not plant_kind(heading.plant).has_sweeps:
        raise ValueError(f'a plant "{heading.plant}" has no sweeps of frequencies; give its records in time')
    outputs = {name: table for name, table in reading.manifest.signals.items() if table.role == "output"}
    for name, table in reading.manifest.signals.items():
        if table.constant is not None:
            raise ValueError(
                f"signals.{name}.constant: of a sweep the drive has an amplitude: drive_amplitude"
            )
    for name, table in outputs.items():
        if not table.parts:
            raise ValueError(
                f"signals.{name} of a sweep needs two columns: in_phase and quadrature, or amplitude and phase"
            )
    if len(outputs) > 1:
        raise ValueError(
            f"a dataset of sweeps has one response, got {', '.join(outputs)}: they are the same motion; remove all but "
            "one"
        )


def _columns(reading: Reading, entry: RecordTable) -> dict[str, SignalTable | None]:
    """Return the columns that the record needs, each with the table that names it; None: the frequencies."""
    found: dict[str, SignalTable | None] = {str(entry.frequency): None}
    for name, table in reading.manifest.signals.items():
        if table.role == "input":
            if _drive_column(reading, entry, name) is not None:
                found[table.column or name] = table
            continue
        found |= dict.fromkeys(table.parts, table)
    return found


def _unit_of(
    reading: Reading, entry: RecordTable, table: SignalTable | None, column: str
) -> tuple[str | None, AmplitudeUnit | None]:
    """Return the unit that a column should have, None: not checked, and the amplitude that it is if not a plain unit.

    Raises:
        ValueError: In words: decibels of no reference or of parts, or a file and a manifest that contradict each other.
    """
    if table is None:
        return None, None
    if column == table.phase:
        return table.phase_unit, None
    name = reading.column(entry, column)
    stated = reading.cache.stated_unit(reading.folder / entry.file, name)
    amplitude = told_amplitude(table.amplitude_unit, column_amplitude(name, stated), name, stated)
    if amplitude is None:
        return (None if table.counts or table.per_drive else table.unit), None
    if amplitude.is_level and table.in_phase is not None:
        raise ValueError(
            f'column "{name}" is in "{amplitude.text}", a logarithm, which has no sign: no part of an amplitude is; '
            "export amplitude and phase, or the parts in a linear unit"
        )
    return stated, amplitude


def _drive_column(reading: Reading, entry: RecordTable, signal: str) -> str | None:
    """Return the column of the drive's amplitude; None: the file has none, or the manifest gives it."""
    column = reading.manifest.signals[signal].column or signal
    known = column in reading.cache.names(reading.folder / entry.file, entry.group)
    return column if known and entry.drive_amplitude is None else None


def _check_amplitude(reading: Reading, entry: RecordTable) -> None:
    """Raise ValueError where nobody tells the amplitude of the drive; remark on it where the response is per drive."""
    for name, table in reading.manifest.signals.items():
        if table.role != "input":
            continue
        if entry.drive_amplitude and table.amplitude_unit is not None:
            raise ValueError(
                f"drive_amplitude is a peak value in {table.unit}, and signals.{name}.amplitude_unit is of a column: "
                "remove one"
            )
        if entry.drive_amplitude or _drive_column(reading, entry, name):
            continue
        words = {"drive": name, "unit": table.unit, "column": table.column or name}
        if not any(one.per_drive for one in reading.manifest.signals.values()):
            raise ValueError(NO_AMPLITUDE.format(**words))
        reading.findings.remark(UNKNOWN_AMPLITUDE.format(**words))


def _check_lengths(lengths: dict[str, int], entry: RecordTable) -> None:
    if len(set(lengths.values())) != 1:
        raise ValueError(
            "columns differ in length: " + ", ".join(f"{name} {n}" for name, n in lengths.items())
        )
    rows = min(lengths.values())
    first, end = entry.rows or (0, rows)
    if end > rows:
        raise ValueError(f"rows = [{first}, {end}] ends after the file's {rows} rows")
    if end - first < LEAST_ROWS:
        raise ValueError(f"a sweep needs at least {LEAST_ROWS} rows, got {end - first}")


def _numbers(reading: Reading, entry: RecordTable, column: str, unit: str | None) -> FloatArray:
    first, end = entry.rows or (0, None)
    name = reading.column(entry, column)
    values = reading.cache.column(reading.folder / entry.file, name, unit, first, end)
    check_finite(values, name, first)
    return values


def _amplitude_numbers(
    reading: Reading, entry: RecordTable, signal: str, column: str, unit: str
) -> FloatArray:
    """Return the peak values (n,) [unit] of a column of amplitudes, or its counts times their scale."""
    table = reading.manifest.signals[signal]
    stated, amplitude = _unit_of(reading, entry, table, column)
    values = _numbers(reading, entry, column, stated)
    if amplitude is not None:
        values = amplitude.peak(values)
        if not table.counts:
            values = converted_amplitude(values, amplitude, unit, reading.column(entry, column))
    return (table.scale or 1.0) * values


def _frequencies(reading: Reading, entry: RecordTable) -> FloatArray:
    """Return the frequencies (n,) [Hz], rising or falling. Raises ValueError in words."""
    column = reading.column(entry, str(entry.frequency))
    stated = reading.cache.stated_unit(reading.folder / entry.file, column)
    values = convert_frequency(
        _numbers(reading, entry, str(entry.frequency), None), entry.frequency_unit or stated or "Hz"
    )
    first = entry.first_row
    bad = np.flatnonzero(values <= 0.0)
    if len(bad):
        raise ValueError(
            f'column "{column}": a frequency must be above 0 Hz, got {values[bad[0]]:g} in {rows_text(bad + first)}; '
            "leave these rows out with rows = [first, end]"
        )
    steps = np.diff(values)
    turns = np.flatnonzero(np.sign(steps) != np.sign(steps[0]))
    if not steps[0]:
        raise ValueError(f'column "{column}" stays at {values[0]:g} Hz from row {first} on: it is no sweep')
    if len(turns):
        turn, rows = int(turns[0]) + 1, len(values)
        way = "rises" if steps[0] > 0.0 else "falls"
        raise ValueError(
            f'column "{column}" {way} to row {first + turn - 1} and then does not: several sweeps in one file; give '
            f"each a record of its own, rows = [{first}, {first + turn}] and rows = [{first + turn}, {first + rows}]"
        )
    return values


def _amplitudes(reading: Reading, entry: RecordTable, signal: str) -> FloatArray:
    """Return the drive's amplitudes (n,) in its held unit."""
    table, rows = reading.manifest.signals[signal], len(_frequencies(reading, entry))
    column = _drive_column(reading, entry, signal)
    if column is None:
        values = np.full(rows, entry.drive_amplitude or 1.0)
    else:
        values = _amplitude_numbers(reading, entry, signal, column, table.unit)
        if (values <= 0.0).any():
            raise ValueError(f'column "{column}": the amplitude of the drive must be above 0 in every row')
    return convert_column(values, table.unit, reading.unit(signal))


def _response(reading: Reading, entry: RecordTable, signal: str, drive: FloatArray) -> FloatArray:
    """Return a response (2 n,), in phase and quadrature of each row, in its held unit."""
    table = reading.manifest.signals[signal]
    unit = table.unit
    if table.per_drive:
        drives = [one.unit for one in reading.manifest.signals.values() if one.role == "input"]
        unit = f"({table.unit})/({drives[0]})"
    first, second = (
        _numbers(reading, entry, part, table.phase_unit)
        if part == table.phase
        else _amplitude_numbers(reading, entry, signal, part, unit)
        for part in table.parts
    )
    parts = (drive if table.per_drive else 1.0) * _as_cartesian(table, first, second).reshape(-1)
    return convert_column(np.ascontiguousarray(parts), table.unit, reading.unit(signal))


def _as_cartesian(table: SignalTable, first: FloatArray, second: FloatArray) -> FloatArray:
    """Return in phase and quadrature (n, 2); the quadrature leads the drive."""
    if table.phase is not None:
        angle = np.deg2rad(second) if table.phase_unit == "deg" else second
        first, second = first * np.cos(angle), first * np.sin(angle)
    return np.column_stack([first, second if table.phase_sign == "lead" else -second])
