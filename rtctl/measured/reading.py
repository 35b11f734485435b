"""`dataset.toml` -> records: all in memory (`read_dataset`) or one at a time (`open_dataset`)."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from rtctl.border.errors import InputError, nearest
from rtctl.measured.columns.conversion import TableCache
from rtctl.measured.dataset import FREQUENCY, Dataset, Record
from rtctl.measured.manifest.findings import Findings
from rtctl.measured.manifest.schema import RecordTable, read_manifest
from rtctl.measured.readers import READERS, suffix_of
from rtctl.measured.records.instrument import instrument_of
from rtctl.measured.records.record_reading import Reading
from rtctl.measured.records.record_reading import check_record as check_record_in_time
from rtctl.measured.records.record_reading import read_record as read_record_in_time
from rtctl.measured.records.sweep_reading import check_sweep, read_sweep
from rtctl.measured.stored import RecordHead, StoredDataset
from rtctl.registry import plant_kind


def read_dataset(path: str | Path) -> Dataset:
    """Return the dataset of a `dataset.toml`, all in memory. Raises InputError with every finding, one a line."""
    path = Path(path)
    reading, names = _begin(path)
    found = [read_record(reading, k, name) for k, name in enumerate(names) if check_record(reading, k)]
    if not reading.findings.lines:
        _find_never_measured(
            reading, lambda name: any(record and record.has(reading.held_name(name)) for record in found)
        )
    reading.findings.raise_all()
    units, holds = _units_and_holds(reading)
    records = [record for record in found if record is not None]
    instrument = instrument_of(records, reading.manifest.dataset.plant, holds)
    return Dataset(
        path=path,
        name=reading.manifest.dataset.name,
        plant=reading.manifest.dataset.plant,
        identity=reading.manifest.dataset.identity,
        units=instrument.units(units),
        holds=holds,
        records=tuple(instrument.applied(record) for record in records),
        incomplete=reading.manifest.dataset.incomplete,
        remarks=(*reading.findings.remarks, *instrument.remarks),
    )


def open_dataset(path: str | Path) -> StoredDataset:
    """Open the dataset of a `dataset.toml`; its records are read on request.

    Manifest, files, columns, units and lengths are checked, not the numbers. Raises InputError with every finding, one
    a line.
    """
    path = Path(path)
    reading, names = _begin(path)
    entries = reading.manifest.records
    for k in range(len(entries)):
        check_record(reading, k)
    if not reading.findings.lines:
        _find_never_measured(reading, lambda name: any(name in reading.present(entry) for entry in entries))
    reading.findings.raise_all()
    units, holds = _units_and_holds(reading)
    defaults = reading.manifest.dataset.conditions
    return StoredDataset(
        path=path,
        name=reading.manifest.dataset.name,
        plant=reading.manifest.dataset.plant,
        identity=reading.manifest.dataset.identity,
        units=units,
        holds=holds,
        heads=tuple(
            RecordHead(name, entry.file, entry.use, entry.repeat, {**defaults, **entry.conditions})
            for name, entry in zip(names, entries, strict=True)
        ),
        read=lambda k: _one_record(reading, k, names[k]),
        remarked=lambda: reading.findings.remarks,
    )


def check_record(reading: Reading, k: int) -> bool:
    """Return whether the k-th record, a sweep or one in time, passes the checks that need no numbers."""
    swept = reading.manifest.records[k].frequency is not None
    return check_sweep(reading, k) if swept else check_record_in_time(reading, k)


def read_record(reading: Reading, k: int, name: str) -> Record | None:
    """Return a record that `check_record` accepted, or None with findings about its numbers."""
    swept = reading.manifest.records[k].frequency is not None
    return read_sweep(reading, k, name) if swept else read_record_in_time(reading, k, name)


def record_names(records: tuple[RecordTable, ...]) -> list[str]:
    """Return each record's own name, or its file's without suffix; group and rows follow where several share a file."""
    stems = [Path(Path(record.file).name.removesuffix(".gz")).stem for record in records]
    names = []
    for record, stem in zip(records, stems, strict=True):
        default = stem
        if stems.count(stem) > 1:
            default += "" if record.group is None else f"_{_as_file_name(record.group)}"
            default += "" if record.rows is None else f"_{record.rows[0]}-{record.rows[1]}"
        names.append(record.name or default)
    return names


def _as_file_name(group: str) -> str:
    """Return the path of a group as a part of a file's name: `rec(2)` as rec2, `day 1/run` as day-1-run."""
    return re.sub(r"\W+", "-", re.sub(r"[(){}]", "", group)).strip("-") or "group"


def _begin(path: Path) -> tuple[Reading, list[str]]:
    """Return a checked manifest and its records' names, which may be a finding; no file is opened yet."""
    if suffix_of(path) in READERS:
        raise InputError(
            f"{path}: is a data file; a manifest is needed, which names its columns and their units: "
            f"rtctl init {shlex.quote(str(path))} writes it"
        )
    manifest = read_manifest(path)
    findings = Findings(str(path))
    names = record_names(manifest.records)
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        findings.add(f'records need different names, "{twice[0]}" appears twice; give each its own name')
    uses = Counter(path.parent / record.file for record in manifest.records)
    for name, table in manifest.signals.items():
        kind = plant_kind(manifest.dataset.plant).signal(name, table.role)
        if kind is not None and kind.remark:
            findings.remark(f"signals.{name}: {kind.remark}")
    cache = TableCache(shared=[file for file, count in uses.items() if count > 1])
    return Reading(manifest=manifest, folder=path.parent, cache=cache, findings=findings), names


def _one_record(reading: Reading, k: int, name: str) -> Record:
    """Read one record. Raises InputError with every finding about its numbers."""
    findings = Findings(reading.findings.source)
    alone = Reading(manifest=reading.manifest, folder=reading.folder, cache=reading.cache, findings=findings)
    record = read_record(alone, k, name)
    findings.raise_all()
    for remark in findings.remarks:
        reading.findings.remark(remark)
    if record is None:
        raise InputError(f"{findings.source}: {reading.where(k)}: gave no record")
    return record


def _units_and_holds(reading: Reading) -> tuple[dict[str, str], dict[str, str]]:
    tables = reading.manifest.signals
    units = {reading.held_name(name): reading.unit(name) for name in tables}
    holds: dict[str, str] = {
        reading.held_name(name): table.hold or "linear"
        for name, table in tables.items()
        if table.role == "input"
    }
    if any(entry.frequency is not None for entry in reading.manifest.records):
        units[FREQUENCY], holds[FREQUENCY] = "Hz", "linear"
    return units, holds


def _find_never_measured(reading: Reading, measured: Callable[[str], bool]) -> None:
    """Report a declared signal that no record has: it is a misspelt column, not a missing instrument."""
    for name, table in reading.manifest.signals.items():
        if table.constant is None and not measured(name):
            column = table.parts[0] if table.parts else table.column or name
            available = {
                other
                for entry in reading.manifest.records
                for other in reading.cache.names(reading.folder / entry.file, entry.group)
            }
            what = (
                "is NaN throughout" if column in available else f"is in no file{nearest(column, available)}"
            )
            reading.findings.add(
                f'signals.{name}: column "{column}" {what}; correct column, or remove [signals.{name}]'
            )
