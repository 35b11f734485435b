"""dataset.toml, model.toml and the data files, as formats.md has them; the same case gives the same bytes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w
from numpy.typing import NDArray
from scipy.io import savemat

from .truth import Quantity

FloatArray = NDArray[np.float64]
FORMATS = ("csv", "parquet", "npz", "mat")
_MAT_HEADER = b"MATLAB 5.0 MAT-file, written by the blind-test generator"


@dataclass(frozen=True, kw_only=True)
class RecordFile:
    """One record as measured."""

    drive: FloatArray
    displacement: FloatArray
    use: str
    repeat: str | None
    initial: float | None
    ignore_first: int
    excitation: str


@dataclass(frozen=True, kw_only=True)
class Layout:
    """How a case is written."""

    format: str
    drive_column: str
    displacement_column: str
    time_column: str | None
    slices: bool
    gap: int
    at_rest: FloatArray
    """What the sensor reads between slices (`gap` samples a gap, one after the other)."""


def draw_layout(rng: np.random.Generator, slices: bool, gap: int, format_: str | None) -> Layout:
    """Names and format; `at_rest` is filled in by the caller."""
    return Layout(
        format=format_ or str(rng.choice(FORMATS)),
        drive_column=str(rng.choice(["drive", "u", "force_cmd", "AI0"])),
        displacement_column=str(rng.choice(["displacement", "x", "x_tip", "vibrometer"])),
        time_column="t" if not slices and rng.random() < 0.25 else None,
        slices=slices,
        gap=gap,
        at_rest=np.zeros(0),
    )


def write_dataset(
    folder: Path,
    name: str,
    layout: Layout,
    records: list[RecordFile],
    rate_Hz: float,
    units: dict[str, str],
    hold: str,
) -> list[str]:
    """Write the manifest and the files; names of the records in the manifest's order."""
    tables: list[dict[str, Any]] = []
    names = []
    slice_of: list[tuple[FloatArray, FloatArray]] = []
    start = 0
    for i, record in enumerate(records):
        file = f"run.{layout.format}" if layout.slices else f"r{i:02d}.{layout.format}"
        table: dict[str, Any] = {"file": file}
        if layout.time_column:
            table["time"] = layout.time_column
        else:
            table["sample_rate_hz"] = rate_Hz
        size = record.drive.size
        if layout.slices:
            table["rows"] = [start, start + size]
            gap = layout.at_rest[i * layout.gap : (i + 1) * layout.gap]
            slice_of += [(record.drive, record.displacement), (np.zeros(gap.size), gap)]
            start += size + gap.size
        else:
            _write_columns(folder / file, layout, record.drive, record.displacement, rate_Hz)
        table |= _record_keys(record)
        tables.append(table)
        names.append(f"{file}[{table['rows'][0]}:{table['rows'][1]}]" if layout.slices else file)
    if layout.slices:
        drive, displacement = (np.concatenate(column) for column in zip(*slice_of, strict=True))
        _write_columns(folder / f"run.{layout.format}", layout, drive, displacement, rate_Hz)
    signals = {
        "drive": {"role": "input", "unit": units["drive"], "hold": hold},
        "displacement": {"role": "output", "unit": units["displacement"]},
    }
    for signal, column in (("drive", layout.drive_column), ("displacement", layout.displacement_column)):
        if column != signal:
            signals[signal]["column"] = column
    if hold == "linear":
        del signals["drive"]["hold"]  # the default
    manifest = {"dataset": {"name": name, "plant": "oscillator"}, "signals": signals, "records": tables}
    (folder / "dataset.toml").write_text(tomli_w.dumps(manifest), encoding="utf-8")
    return names


def _record_keys(record: RecordFile) -> dict[str, Any]:
    keys: dict[str, Any] = {"use": record.use}
    if record.ignore_first:
        keys["ignore_first"] = record.ignore_first
    if record.repeat:
        keys["repeat"] = record.repeat
    if record.initial is not None:
        keys["initial"] = {"displacement": record.initial}
    return keys | {"conditions": {"excitation": record.excitation}}


def _write_columns(
    path: Path, layout: Layout, drive: FloatArray, displacement: FloatArray, rate_Hz: float
) -> None:
    columns = {layout.drive_column: drive, layout.displacement_column: displacement}
    if layout.time_column:
        columns = {layout.time_column: np.arange(drive.size) / rate_Hz, **columns}
    if layout.format == "csv":
        rows = np.column_stack(list(columns.values()))
        np.savetxt(path, rows, fmt="%.10g", delimiter=",", header=",".join(columns), comments="")
    elif layout.format == "parquet":
        pq.write_table(pa.table(columns), path)
    elif layout.format == "npz":
        np.savez(path, **columns)
    else:
        savemat(path, columns, oned_as="column")
        with path.open("r+b") as file:
            file.write(_MAT_HEADER.ljust(116))  # SciPy writes today's date there


def write_model(folder: Path, parameters: dict[str, Quantity]) -> None:
    """The nominal model, no mechanisms."""
    tables = {name: {"value": q.value, "unit": q.unit} for name, q in parameters.items()}
    model = {"model": {"kind": "oscillator", "parameters": tables}}
    (folder / "model.toml").write_text(tomli_w.dumps(model), encoding="utf-8")
