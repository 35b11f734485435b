"""Tables in files: one reader a format, registered by suffix; each gives named columns of float64."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtctl.border.errors import InputError, nearest

FloatArray = NDArray[np.float64]
Table = Mapping[str, FloatArray]


def read_table(path: Path, columns: list[str]) -> dict[str, FloatArray]:
    """The named columns of a file, each (rows,). Raises InputError naming file, column and what to do."""
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(f'{path}: no reader for "{path.suffix}" files; known: {", ".join(sorted(READERS))}')
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        table = reader(path)
    except InputError:
        raise
    except Exception as error:  # each library raises its own family for a file that it cannot read
        raise InputError(f"{path}: cannot be read as {path.suffix}: {error}") from None
    for column in columns:
        if column not in table:
            raise InputError(f'{path}: no column "{column}"{nearest(column, table)}')
    return {column: _floats(path, column, table[column]) for column in columns}


def _floats(path: Path, column: str, values: Any) -> FloatArray:
    try:
        array = np.asarray(values, dtype=np.float64).squeeze()
    except (TypeError, ValueError):
        raise InputError(f'{path}: column "{column}" holds text, numbers are needed') from None
    if array.ndim != 1:
        raise InputError(f'{path}: column "{column}" has shape {array.shape}, one value a row is needed')
    if len(array) == 0:
        raise InputError(f'{path}: column "{column}" is empty')
    return np.ascontiguousarray(array)


def _read_csv(path: Path) -> Table:
    with path.open(newline="", encoding="utf-8-sig") as file:
        header = [name.strip() for name in next(csv.reader(file), [])]
        if not any(header):
            raise InputError(f"{path}: is empty; the first line of a CSV names its columns")
        rows: list[list[float]] = []
        for number, row in enumerate(csv.reader(file), start=2):
            if len(row) == 0:
                continue
            if len(row) != len(header):
                raise InputError(f"{path}: line {number} has {len(row)} fields, the header {len(header)}")
            try:
                rows.append([float(field) if field.strip() else np.nan for field in row])
            except ValueError as error:
                raise InputError(f"{path}: line {number}: {error}") from None
    values = np.array(rows, dtype=np.float64).reshape(len(rows), len(header))
    return dict(zip(header, values.T, strict=True))


def _read_parquet(path: Path) -> Table:
    import pyarrow.parquet as pq

    table = pq.read_table(path)
    return {name: table.column(name).to_numpy() for name in table.column_names}


def _read_arrow(path: Path) -> Table:
    import pyarrow as pa

    with pa.memory_map(str(path)) as source:
        table = pa.ipc.open_file(source).read_all()
        return {name: table.column(name).to_numpy().copy() for name in table.column_names}


def _read_npz(path: Path) -> Table:
    with np.load(path, allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


def _read_mat(path: Path) -> Table:
    from scipy.io import loadmat

    try:
        return {name: value for name, value in loadmat(path).items() if not name.startswith("__")}
    except NotImplementedError:
        raise InputError(f"{path}: a MAT file of version 7.3; save it with -v7") from None


READERS: dict[str, Callable[[Path], Table]] = {
    ".csv": _read_csv,
    ".parquet": _read_parquet,
    ".arrow": _read_arrow,
    ".npz": _read_npz,
    ".mat": _read_mat,
}
