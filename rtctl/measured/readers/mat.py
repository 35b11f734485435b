"""MATLAB .mat: version 5 by SciPy, a variable at a time; version 7.3 is HDF5.

Fields of a struct are columns, `run.x_tip`, also in an array of structs, `run.signals(2).values`, and in a cell,
`runs{1}.x`.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, whosmat
from scipy.io.matlab import MatlabOpaque

from rtctl.measured.readers import h5
from rtctl.measured.readers.groups import place_of
from rtctl.measured.readers.mat_headers import Variable, describe_object, is_version_5, variables
from rtctl.measured.readers.stated.attributes import LONGEST_TEXT
from rtctl.measured.readers.stated.beside import MOST_NUMBERS, levels_of
from rtctl.measured.readers.table import Column, Header, Table, reading, vector_rows

Steps = tuple[int | str, ...]
"""Way from a variable to an array within: places in cells and arrays of structs, names of fields."""
MOST_ITEMS = 64
"""Items of a cell or an array of structs whose arrays are columns."""
_FIRST_NAME = re.compile(r"\w+")


def read(path: Path) -> Table:
    """Return the variables of a .mat file, and the fields of its structs, as columns. Raises ValueError in words."""
    if h5.is_hdf5(path):
        return h5.read(path, separator=".")
    headers: dict[str, Header] = {}
    places: dict[str, Steps] = {}
    few: dict[str, Any] = {}
    for name, shape, kind, is_object in _listed(path):
        if is_object:
            headers[name] = Header(shape=shape, refusal=describe_object(kind, name))
        elif kind in ("struct", "cell"):
            with reading("a MATLAB file"):
                for column, value, steps in _fields(name, _variable(path, name), ()):
                    headers[column], places[column] = _header(value, column), steps
                    if not isinstance(value, MatlabOpaque) and value.size <= MOST_NUMBERS:
                        few[column] = value
        else:
            dtype = np.dtype(np.complex128) if kind == "complex" else None
            headers[name] = Header(shape=shape, dtype=dtype, refusal=_refusal(kind))
            if prod(shape) <= (LONGEST_TEXT if kind == "char" else MOST_NUMBERS):
                with reading("a MATLAB file"):
                    few[name] = _variable(path, name)

    def load(name: str, first: int, end: int) -> Column:
        with reading("a MATLAB file"):
            value = _variable(path, _FIRST_NAME.match(name)[0] if name in places else name)  # type: ignore[index]
            for step in places.get(name, ()):
                value = value.flat[step] if isinstance(step, int) else value[step]
            return np.array(value[vector_rows(value.shape, first, end)])  # a view would keep all alive

    inside = {name: place_of(name, ".") for name in headers}
    beside = levels_of(few, inside)
    return Table(columns=headers, load=load, piecewise=False, places=inside, beside=beside)


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


def _fields(name: str, value: Any, steps: Steps) -> Iterator[tuple[str, Any, Steps]]:
    """Yield name, array and the way to it of all that is below a struct or a cell, and arrays of these themselves."""
    is_container = not isinstance(value, MatlabOpaque) and value.dtype.hasobject and value.size
    if not is_container or value.size > MOST_ITEMS:
        yield name, value, steps
        return
    names, several = value.dtype.names, value.size > 1
    if names is None or several:
        yield name, value, steps  # refused when it is used
    for k in range(value.size):
        if names is None:
            yield from _fields(f"{name}{{{k + 1}}}", value.flat[k], (*steps, k))
            continue
        one = f"{name}({k + 1})" if several else name
        for field in names:
            yield from _fields(f"{one}.{field}", value.flat[k][field], (*steps, k, field))


def _header(value: Any, column: str) -> Header:
    if isinstance(value, MatlabOpaque):
        kind = value.flat[0]["s2"] if value.size else b""
        text = kind.decode("latin-1") if isinstance(kind, bytes) else str(kind)
        return Header(shape=(1,), refusal=describe_object(text, column))
    structs = value.dtype.names is not None
    refusal = _refusal("struct") if structs else _refusal("cell") if value.dtype.hasobject else ""
    return Header(shape=value.shape, dtype=None if refusal else value.dtype, refusal=refusal)


def _refusal(kind: str) -> str:
    numeric = kind in ("double", "single", "logical", "complex") or kind.startswith(("int", "uint"))
    array = " array" if kind == "struct" else ""
    return "" if numeric else f"is a MATLAB {kind}{array}, numbers are needed"
