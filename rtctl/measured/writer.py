"""Datasets to disk: Parquet files first, the manifest last, so that what looks whole is whole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rtctl.measured.dataset import Record
from rtctl.measured.manifest import SIGNALS_OF
from rtctl.recording import write_parquet


def write_dataset(
    folder: Path, *, name: str, plant: str, identity: str, records: Sequence[Record], metadata: Mapping[str, str]
) -> Path:
    """Write records (signals in the plant's own units, inputs held) and their manifest; returns its path."""
    import tomli_w

    present = [s for s in SIGNALS_OF[plant] if any(record.has(s) for record in records)]
    units = {signal: SIGNALS_OF[plant][signal][1] or "" for signal in present}
    tables: list[dict[str, Any]] = []
    for index, record in enumerate(records):
        file = f"r{index:02d}.parquet"
        write_parquet(folder / file, record.signals, units, metadata)
        table: dict[str, Any] = {"file": file, "sample_rate_hz": 1.0 / record.period_s, "use": record.use}
        if record.ignore_first:
            table["ignore_first"] = record.ignore_first
        if record.conditions:
            table["conditions"] = dict(record.conditions)
        tables.append(table)
    signals = {
        signal: {"role": SIGNALS_OF[plant][signal][0], "unit": units[signal]}
        | ({"hold": "zero"} if SIGNALS_OF[plant][signal][0] == "input" else {})
        for signal in present
    }
    manifest = {
        "dataset": {"name": name, "plant": plant, "identity": identity},
        "signals": signals,
        "records": tables,
    }
    path = folder / "dataset.toml"
    part = path.with_name(path.name + ".part")
    part.write_text(tomli_w.dumps(manifest), encoding="utf-8")
    part.replace(path)
    return path
