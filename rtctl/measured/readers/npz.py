"""NumPy .npz: one array a column."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from rtctl.measured.readers.table import Column, Table


def read(path: Path) -> Table:
    """Columns of an .npz file. Raises ValueError in words."""
    if not zipfile.is_zipfile(path):
        raise ValueError("not an .npz file; save it with numpy.savez(path, drive=..., displacement=...)")

    def load(name: str) -> Column:
        with np.load(path, allow_pickle=False) as arrays:
            try:
                return np.asarray(arrays[name])
            except ValueError:
                raise ValueError(f'array "{name}" holds Python objects, numbers are needed') from None

    with np.load(path, allow_pickle=False) as arrays:
        return Table(columns=tuple(arrays.files), load=load)
