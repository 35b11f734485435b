"""HDF5 and MATLAB 7.3: datasets by their path in the file. h5py is imported only when a file needs it."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

import numpy as np

from rtctl.measured.readers.table import Column, Table

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_USER_BLOCKS = (0, 512, 1024, 2048)  # MATLAB puts its own header in front (HDF5 specification, II.A)


def is_hdf5(path: Path) -> bool:
    """Whether the file carries HDF5's signature."""
    with path.open("rb") as file:
        for offset in _USER_BLOCKS:
            file.seek(offset)
            if file.read(len(_SIGNATURE)) == _SIGNATURE:
                return True
    return False


def read(path: Path) -> Table:
    """Numeric datasets of an HDF5 file as columns. Raises ValueError in words."""
    if not is_hdf5(path):
        raise ValueError("not an HDF5 file")
    h5py = _h5py()
    names: list[str] = []
    with h5py.File(path, "r") as file:
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)

    def load(name: str) -> Column:
        with h5py.File(path, "r") as file:
            return np.asarray(file[name])

    return Table(columns=tuple(name for name in names if not name.startswith("#refs#")), load=load)


def _h5py() -> ModuleType:
    try:
        return importlib.import_module("h5py")
    except ImportError:
        raise ValueError(
            "is an HDF5 file (MATLAB 7.3 also is), which needs h5py: pip install h5py, "
            "or save as Parquet, .npz or MATLAB version 5 (save -v7)"
        ) from None
