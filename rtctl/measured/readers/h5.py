"""HDF5 and MATLAB 7.3: datasets by their path in the file. h5py is imported only when a file needs it."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from rtctl.extras import missing_message
from rtctl.measured.readers.table import Column, Header, Table, reading, vector_rows

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_USER_BLOCKS = (0, 512, 1024, 2048)  # MATLAB puts its own header in front (HDF5 specification, II.A)


def is_hdf5(path: Path) -> bool:
    """Return whether the file carries HDF5's signature."""
    with path.open("rb") as file:
        for offset in _USER_BLOCKS:
            file.seek(offset)
            if file.read(len(_SIGNATURE)) == _SIGNATURE:
                return True
    return False


def read(path: Path, separator: str = "/") -> Table:
    """Return the datasets of an HDF5 file as columns, groups joined by `separator`. Raises ValueError in words."""
    if not is_hdf5(path):
        raise ValueError("not an HDF5 file")
    h5py = _h5py()
    headers: dict[str, Header] = {}
    paths: dict[str, str] = {}

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and not name.startswith("#refs#"):  # MATLAB's cells, by reference
            paths[name.replace("/", separator)] = name
            headers[name.replace("/", separator)] = _header(item)

    with reading("an HDF5 file"), h5py.File(path, "r") as file:
        file.visititems(visit)

    def load(name: str, first: int, end: int) -> Column:
        with reading("an HDF5 file"), h5py.File(path, "r") as file:
            dataset = file[paths[name]]
            return np.asarray(dataset[vector_rows(dataset.shape, first, end)])

    return Table(columns=headers, load=load)


def _header(dataset: Any) -> Header:
    """Return the header of a dataset; its unit may stand in the attribute "unit" or "units"."""
    kind = _text(dataset.attrs.get("MATLAB_class"))
    if dataset.shape is None or "MATLAB_empty" in dataset.attrs:
        return Header(shape=(0,))
    refusal = f"is a MATLAB {kind}, numbers are needed" if kind in ("char", "cell", "struct", "table") else ""
    fields = dataset.dtype.names
    if fields is not None and set(fields) == {"real", "imag"}:
        refusal = "holds complex numbers, real numbers are needed"
    unit = _text(dataset.attrs.get("unit", dataset.attrs.get("units")))
    return Header(shape=dataset.shape, dtype=dataset.dtype, unit=unit or None, refusal=refusal)


def _text(attribute: Any) -> str:
    if isinstance(attribute, bytes):
        return attribute.decode(errors="replace")
    return attribute if isinstance(attribute, str) else ""


def _h5py() -> ModuleType:
    try:
        return importlib.import_module("h5py")
    except ImportError:
        raise ValueError(
            "is an HDF5 file (MATLAB 7.3 also is): "
            f"{missing_message('h5py', 'reading it')}, or save as Parquet, .npz or MATLAB version 5 (save -v7)"
        ) from None
