"""MATLAB .mat: version 5 by SciPy, a variable at a time; version 7.3 is HDF5. Fields of a struct: `run.x_tip`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, whosmat

from rtctl.measured.readers import h5
from rtctl.measured.readers.table import Column, Header, Table, reading, vector_rows

_HEADER_BYTES = 128  # MAT-File Format, "Level 5 header": text, version, two bytes that tell the byte order
_TAG_BYTES = 8


def read(path: Path) -> Table:
    """Return the variables of a .mat file, and the fields of its structs, as columns. Raises ValueError in words."""
    if h5.is_hdf5(path):
        return h5.read(path, separator=".")
    headers: dict[str, Header] = {}
    _check_whole(path)
    with reading("a MATLAB file"):
        for name, shape, kind in whosmat(path):
            if kind == "struct":
                headers |= {column: _header(value) for column, value in _fields(name, _variable(path, name))}
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


def _variable(path: Path, name: str) -> Any:
    return loadmat(path, variable_names=[name])[name]


def _fields(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield dotted names and arrays below a struct; an array of structs stays one, and is refused when it is used."""
    if value.dtype.names is None or value.size != 1:
        yield name, value
        return
    for field in value.dtype.names:
        yield from _fields(f"{name}.{field}", value.flat[0][field])


def _header(value: Any) -> Header:
    structs = value.dtype.names is not None
    refusal = _refusal("struct") if structs else _refusal("cell") if value.dtype.hasobject else ""
    return Header(shape=value.shape, dtype=None if refusal else value.dtype, refusal=refusal)


def _refusal(kind: str) -> str:
    numeric = kind in ("double", "single", "logical") or kind.startswith(("int", "uint"))
    array = " array" if kind == "struct" else ""
    return "" if numeric else f"is a MATLAB {kind}{array}, numbers are needed"


def _check_whole(path: Path) -> None:
    """Follow the tags of version 5: SciPy silently passes over a variable that was cut off."""
    size = path.stat().st_size
    with path.open("rb") as file:
        mark = file.read(_HEADER_BYTES)[-2:]
        if mark not in (b"IM", b"MI"):
            return  # version 4, or no MATLAB file: SciPy tells
        start = _HEADER_BYTES
        while start < size:
            file.seek(start)
            tag = file.read(_TAG_BYTES)
            content_bytes = int.from_bytes(tag[4:], "little" if mark == b"IM" else "big")
            if len(tag) < _TAG_BYTES or start + _TAG_BYTES + content_bytes > size:
                raise ValueError(
                    f"is cut off: the variable at byte {start} is not complete; copy or save it again"
                )
            start += _TAG_BYTES + content_bytes
