"""dataset.toml and the data files of a vo2, as formats.md has them; the same case gives the same bytes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w
from scipy.io import savemat

from .physics import FloatArray

FORMATS = ("csv", "parquet", "npz", "mat")
UNITS = {"current": "mA", "resistance": "ohm", "deflection": "um"}
_MAT_HEADER = b"MATLAB 5.0 MAT-file, written by the blind-test generator"


@dataclass(frozen=True, kw_only=True)
class RecordFile:
    """One record as measured; columns by signal."""

    columns: dict[str, FloatArray]
    rate_Hz: float
    use: str
    repeat: str | None
    ignore_first: int
    excitation: str


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Names in the files, and their format."""

    format: str
    names: dict[str, str]
    time: str | None


def draw_layout(rng: np.random.Generator, format_: str | None) -> Layout:
    """Names and format."""
    return Layout(
        format=format_ or str(rng.choice(FORMATS)),
        names={
            "current": str(rng.choice(["current", "i_heater", "I_cmd"])),
            "resistance": str(rng.choice(["resistance", "R", "r_film"])),
            "deflection": str(rng.choice(["deflection", "psd", "tip"])),
        },
        time="t" if rng.random() < 0.25 else None,
    )


def write_dataset(folder: Path, name: str, layout: Layout, records: list[RecordFile]) -> list[str]:
    """Write the manifest and the files; names of the records' files in the manifest's order."""
    folder.mkdir(parents=True, exist_ok=True)
    tables: list[dict[str, Any]] = []
    for i, record in enumerate(records):
        file = f"r{i:02d}.{layout.format}"
        columns = {layout.names[signal]: values for signal, values in record.columns.items()}
        if layout.time:
            columns = {layout.time: np.arange(record.columns["current"].size) / record.rate_Hz, **columns}
        _write_columns(folder / file, layout.format, columns)
        table: dict[str, Any] = {"file": file}
        table |= {"time": layout.time} if layout.time else {"sample_rate_hz": record.rate_Hz}
        table["use"] = record.use
        if record.ignore_first:
            table["ignore_first"] = record.ignore_first
        if record.repeat:
            table["repeat"] = record.repeat
        tables.append(table | {"conditions": {"excitation": record.excitation}})
    signals: dict[str, dict[str, str]] = {}
    for signal, unit in UNITS.items():
        signals[signal] = {"role": "input" if signal == "current" else "output", "unit": unit}
        if signal == "current":
            signals[signal]["hold"] = "zero"
        if layout.names[signal] != signal:
            signals[signal]["column"] = layout.names[signal]
    manifest = {"dataset": {"name": name, "plant": "vo2"}, "signals": signals, "records": tables}
    (folder / "dataset.toml").write_text(tomli_w.dumps(manifest), encoding="utf-8")
    return [table["file"] for table in tables]


def _write_columns(path: Path, format_: str, columns: dict[str, FloatArray]) -> None:
    if format_ == "csv":
        rows = np.column_stack(list(columns.values()))
        np.savetxt(path, rows, fmt="%.10g", delimiter=",", header=",".join(columns), comments="")
    elif format_ == "parquet":
        pq.write_table(pa.table(columns), path)
    elif format_ == "npz":
        np.savez(path, **columns)
    else:
        savemat(path, columns, oned_as="column")
        with path.open("r+b") as file:
            file.write(_MAT_HEADER.ljust(116))  # SciPy writes today's date there
