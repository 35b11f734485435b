"""MATLAB .mat: version 5 by SciPy, a variable at a time; version 7.3 is HDF5. Fields of a struct: `run.x_tip`."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, whosmat
from scipy.io.matlab import MatlabOpaque

from rtctl.measured.readers import h5
from rtctl.measured.readers.mat_headers import Variable, describe_object, is_version_5, variables
from rtctl.measured.readers.table import Column, Header, Table, reading, vector_rows


def read(path: Path) -> Table:
    """Return the variables of a .mat file, and the fields of its structs, as columns. Raises ValueError in words."""
    if h5.is_hdf5(path):
        return h5.read(path, separator=".")
    headers: dict[str, Header] = {}
    for name, shape, kind, is_object in _listed(path):
        if is_object:
            headers[name] = Header(shape=shape, refusal=describe_object(kind, name))
        elif kind == "struct":
            with reading("a MATLAB file"):
                fields = list(_fields(name, _variable(path, name)))
            headers |= {column: _header(value, column) for column, value in fields}
        else:
            headers[name] = Header(shape=shape, refusal=_refusal(kind))

    def load(name: str, first: int, end: int) -> Column:
        with reading("a MATLAB file"):
            variable, *fields = name.split(".")
            value = _variable(path, variable)
            for field in fields:
                value = value.flat[0][field]
            return np.array(value[vector_rows(value.shape, first, end)])  # a view would keep all alive

    return Table(columns=headers, load=load, piecewise=False)


def _listed(path: Path) -> list[Variable]:
    if is_version_5(path):
        try:
            return list(variables(path))
        except (struct.error, zlib.error, StopIteration, RuntimeError) as error:
            raise ValueError(f"not a MATLAB file, or damaged: {error}") from None
    with reading("a MATLAB file"):
        return [Variable(name, shape, kind) for name, shape, kind in whosmat(path)]


def _variable(path: Path, name: str) -> Any:
    return loadmat(path, variable_names=[name])[name]


def _fields(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield dotted names and arrays below a struct; an array of structs stays one, and is refused when it is used."""
    if isinstance(value, MatlabOpaque) or value.dtype.names is None or value.size != 1:
        yield name, value
        return
    for field in value.dtype.names:
        yield from _fields(f"{name}.{field}", value.flat[0][field])


def _header(value: Any, column: str) -> Header:
    if isinstance(value, MatlabOpaque):
        kind = value.flat[0]["s2"] if value.size else b""
        text = kind.decode("latin-1") if isinstance(kind, bytes) else str(kind)
        return Header(shape=(1,), refusal=describe_object(text, column))
    structs = value.dtype.names is not None
    refusal = _refusal("struct") if structs else _refusal("cell") if value.dtype.hasobject else ""
    return Header(shape=value.shape, dtype=None if refusal else value.dtype, refusal=refusal)


def _refusal(kind: str) -> str:
    if kind == "complex":
        return "holds complex128, real numbers are needed"
    numeric = kind in ("double", "single", "logical") or kind.startswith(("int", "uint"))
    array = " array" if kind == "struct" else ""
    return "" if numeric else f"is a MATLAB {kind}{array}, numbers are needed"
