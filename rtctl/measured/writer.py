"""Write `Record`s to a folder: one Parquet file each, then the manifest, so that a manifest means complete data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from rtctl.border.errors import RunError
from rtctl.border.units.unit_text import SI
from rtctl.measured.dataset import Record
from rtctl.output.atomic_write import replacing
from rtctl.output.own_files import mark_of, refuse_foreign
from rtctl.recording import write_parquet
from rtctl.registry import SignalKind, plant_kind


# eight parameters because each is one part of the manifest, and the last four have defaults
def write_dataset(  # noqa: PLR0913
    folder: Path,
    *,
    name: str,
    plant: str,
    records: Sequence[Record],
    identity: str = "",
    units: Mapping[str, str] | None = None,
    holds: Mapping[str, str] | None = None,
    metadata: Mapping[str, str] | None = None,
    incomplete: str = "",
) -> Path:
    """Write records and `dataset.toml`; return the manifest's path.

    Args:
        folder: Folder of the dataset.
        name: Name of the dataset.
        plant: Kind of plant.
        records: Records to write.
        identity: Identity of the device.
        units: Units by signal; needed where the plant does not fix them.
        holds: Holds by input; "zero" by default, as drivers hold.
        metadata: Texts for each file's schema, which an acquisition has.
        incomplete: Why records are missing that were to be taken; "": none is.

    Raises:
        RunError: A reader would refuse the dataset; raised before any file is written.
        InputError: One of the files is there, and is of somebody else; raised before any file is written.
    """
    kinds = _kinds_of(plant, records, holds or {})
    units = {**{signal: kind.unit for signal, kind in kinds.items() if kind.unit}, **(units or {})}
    contents = [_measured(record, plant, kinds) for record in records]
    _check_writable(records, contents, units)
    present = [signal for signal in kinds if any(signal in content for content in contents)]
    holds = {signal: "zero" for signal, kind in kinds.items() if kind.role == "input"} | dict(holds or {})
    known = {"identity": identity, "incomplete": incomplete}
    manifest = {
        "dataset": {"name": name, "plant": plant, **{key: text for key, text in known.items() if text}},
        "signals": {
            signal: _signal_table(kinds[signal].role, units[signal], holds.get(signal)) for signal in present
        },
        "records": [_record_table(record, plant) for record in records],
    }
    command = "acquire" if metadata else "write_dataset"
    text = f"# Written by {mark_of(command)}\n\n{tomli_w.dumps(manifest)}"
    path = folder / "dataset.toml"
    for file in (path, *(folder / _file_of(record) for record in records)):
        refuse_foreign(file, command)
    path.unlink(missing_ok=True)  # an old manifest must not stand over new files
    for record, content in zip(records, contents, strict=True):
        write_parquet(folder / _file_of(record), content, units, metadata or {}, command)
    with replacing(path, command) as partial:
        partial.write_text(text, encoding="utf-8")
    return path


def _file_of(record: Record) -> str:
    return f"{record.name}.parquet"


def _kinds_of(plant: str, records: Sequence[Record], holds: Mapping[str, str]) -> Mapping[str, SignalKind]:
    """Return the signals of a kind of plant; those of the records where a model names them, inputs with a hold."""
    if not plant_kind(plant).free_signals:
        return plant_kind(plant).signals
    present = dict.fromkeys(name for record in records for name in record.signals)
    return {name: SignalKind(role="input" if name in holds else "output") for name in present}


def _measured(record: Record, plant: str, kinds: Mapping[str, SignalKind]) -> dict[str, Any]:
    """Return the signals in the order of the kind of plant, without instruments that were absent (all NaN)."""
    unknown = sorted(record.signals.keys() - kinds.keys())
    if unknown:
        raise RunError(f'record {record.name}: a plant "{plant}" has no signal {", ".join(unknown)}')
    return {
        signal: record.signals[signal]
        for signal, kind in kinds.items()
        if record.has(signal) and not (kind.optional and np.isnan(record.signals[signal]).all())
    }


def _check_writable(
    records: Sequence[Record], contents: Sequence[Mapping[str, Any]], units: Mapping[str, str]
) -> None:
    names = [record.name for record in records]
    if len(set(names)) < len(names) or not names:
        raise RunError(f"a dataset needs records with different names, got {names}")
    for name, content in zip(names, contents, strict=True):
        for signal, values in content.items():
            if signal not in units:
                raise RunError(f"record {name}: the unit of {signal} is not given")
            bad = np.flatnonzero(~np.isfinite(values))
            if len(bad):
                raise RunError(
                    f"record {name}: {signal} [{units[signal]}] has {len(bad)} of {len(values)} samples "
                    f"that are not finite, the first at {bad[0]}; no dataset is written"
                )


def _signal_table(role: str, unit: str, hold: str | None) -> dict[str, str]:
    return {"role": role, "unit": unit, **({"hold": hold} if hold else {})}


def _record_table(record: Record, plant: str) -> dict[str, Any]:
    table: dict[str, Any] = {
        "file": _file_of(record),
        "sample_rate_hz": 1.0 / record.period_s,
        "use": record.use,
    }
    if record.ignore_first:
        table["ignore_first"] = record.ignore_first
    if record.repeat is not None:
        table["repeat"] = record.repeat
    if record.conditions:
        table["conditions"] = dict(record.conditions)
    if record.initial:
        table["initial"] = _initial_table(record, plant)
    return table


def _initial_table(record: Record, plant: str) -> dict[str, Any]:
    """Return the start of a record: numbers in the signals' units, or of states of a user's model in SI base units."""
    if not plant_kind(plant).free_signals:
        return dict(record.initial)
    return {name: f"{value!r} {SI}" for name, value in record.initial.items()}
