"""MATLAB .mat: version 5 by SciPy, version 7.3 is HDF5."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.io import loadmat, whosmat
from scipy.io.matlab import MatReadError

from rtctl.measured.readers import h5
from rtctl.measured.readers.table import Column, Table


def read(path: Path) -> Table:
    """Top-level variables of a .mat file as columns. Raises ValueError in words."""
    if h5.is_hdf5(path):
        return h5.read(path)
    try:
        names = tuple(name for name, _, _ in whosmat(path))
    except (ValueError, MatReadError, NotImplementedError, TypeError) as error:
        raise ValueError(f"not a MATLAB file: {error}") from None

    def load(name: str) -> Column:
        return np.asarray(loadmat(path, variable_names=[name])[name])

    return Table(columns=names, load=load)
