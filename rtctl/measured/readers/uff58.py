"""Universal file, datasets 58 and 58b (function at nodal DOF), by pyuff: a column a function of time.

A complex function of frequency (a frequency response, type 4; a spectrum) is two columns, its name followed by
" in phase" (real part) and " quadrature" (imaginary part), beside a column "frequency" [Hz] for all functions of the
same frequencies.

A column is named by ID line 1. Where that is empty, NONE or the same for several functions, the response
follows as "node:direction" (`x tip 12:+Z`, or `12:+Z` alone), and where that does not tell them apart either,
the function's place in the file from 1 (`x tip 12:+Z #3`). The ordinate's units label is the column's unit,
the abscissa's increment its period.

Reference: SDRC universal dataset 58, records 1 (ID line 1), 6 (DOF), 7 (form), 8 (abscissa), 9 (ordinate).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyuff

from rtctl.measured.readers.table import Column, Header, Table, reading
from rtctl.measured.stated_unit import time_unit_of
from rtctl.measured.units import convert_column

Fields = Mapping[str, Any]

_DIRECTIONS = ("S", "X", "Y", "Z", "RX", "RY", "RZ")
_COMPLEX, _EVEN = (5, 6), 1  # record 7, fields 1 and 3
_OF_TIME = (0, 1, 17)  # record 8, field 1: unknown, general, time
_FREQUENCY, _UNITS = 18, 164
PARTS = {" in phase": np.real, " quadrature": np.imag}
"""Ends of the names of the two columns of a complex function, with what they hold of it."""
_ABSCISSAE = {18: "frequency", 19: "rpm", 20: "order"}


def read(path: Path) -> Table:
    """Return the functions of a universal file as columns. Raises ValueError in words."""
    _check_whole(path)
    with reading("a universal file (UFF)"):
        file = pyuff.UFF(str(path))
        sets = [int(k) for k in np.flatnonzero(np.asarray(file.get_set_types()) == 58)]
        functions = [file.read_sets(k, header_only=True) for k in sets]
    if not functions:
        raise ValueError("holds no dataset 58 (measured functions); export the time records as UFF 58")
    names = _names(functions)
    responses = [name for name, function in zip(names, functions, strict=True) if _is_response(function)]
    place = dict(zip(names, sets, strict=True))
    parts = {f"{name}{part}": (name, part) for name in responses for part in PARTS}
    with reading("a universal file (UFF)"):
        axes = _frequency_axes([(name, file.read_sets(place[name])) for name in responses])

    def load(name: str, first: int, end: int) -> Column:
        if name in axes:
            return axes[name][first:end]
        whole, part = parts.get(name, (name, ""))
        with reading("a universal file (UFF)"):
            function = file.read_sets(place[whole])
        values, stated = np.asarray(function["data"]), int(function["num_pts"])
        if len(values) < stated:
            raise ValueError(f'column "{name}" ends after {len(values)} of {stated} values: damaged')
        return PARTS[part](values[first:end]) if part else values[first:end]

    lengths = _length_units(path)
    headers = {name: _header(function) for name, function in zip(names, functions, strict=True)}
    columns = {
        name: Header(shape=values.shape, dtype=values.dtype, unit="Hz") for name, values in axes.items()
    }
    for name, header in headers.items():
        both = [f"{name}{part}" for part in PARTS] if name in responses else [name]
        columns |= dict.fromkeys(both, header)
    return Table(columns=columns, load=load, piecewise=False, remarks=lengths)


def _length_units(path: Path) -> tuple[str, ...]:
    """Return a remark where the file has units (dataset 164) in which a length of 1 is no metre."""
    with reading("a universal file (UFF)"):
        file = pyuff.UFF(str(path))
        sets = [int(k) for k in np.flatnonzero(np.asarray(file.get_set_types()) == _UNITS)]
        units = [file.read_sets(k) for k in sets]
    factors = {float(one.get("length", 1.0)): str(one.get("units_description", "")).strip() for one in units}
    return tuple(
        f"the file states units (dataset 164, {text or 'not named'}) of which {factor:.6g} make a metre; ordinates "
        "without a label of their own may be in these: check the units of the manifest"
        for factor, text in factors.items()
        if abs(factor - 1.0) > 1e-9
    )


def _is_response(function: Fields) -> bool:
    """Return whether it is a complex function of frequency."""
    return function["ord_data_type"] in _COMPLEX and function["abscissa_spec_data_type"] == _FREQUENCY


def _frequency_axes(functions: list[tuple[str, Fields]]) -> dict[str, Column]:
    """Return the columns of frequencies [Hz]: one where all functions have the same, else one for each."""
    axes = {name: np.asarray(function["x"], np.float64) for name, function in functions}
    values = list(axes.values())
    if all(np.array_equal(one, values[0]) for one in values):
        return {"frequency": values[0]} if values else {}
    return {f"frequency of {name}": one for name, one in axes.items()}


def _names(functions: list[Fields]) -> list[str]:
    short = [_label(function, "id1") for function in functions]
    counts = Counter(short)
    long = [
        name if name and counts[name] == 1 else f"{name} {_response(function)}".strip()
        for name, function in zip(short, functions, strict=True)
    ]
    again = Counter(long)
    return [name if again[name] == 1 else f"{name} #{k}" for k, name in enumerate(long, start=1)]


def _response(function: Fields) -> str:
    """Return node and direction as `12:+Z` (record 6, fields 6 and 7)."""
    direction = int(function["rsp_dir"])
    sign = "" if direction == 0 else "+" if direction > 0 else "-"
    axis = _DIRECTIONS[abs(direction)] if abs(direction) < len(_DIRECTIONS) else str(abs(direction))
    return f"{function['rsp_node']}:{sign}{axis}"


def _header(function: Fields) -> Header:
    return Header(
        shape=(int(function["num_pts"]),),
        dtype=np.dtype(np.float64),
        unit=_label(function, "ordinate_axis_units_lab") or None,
        period_s=None if _is_response(function) else _period_s(function),
        period_key="abscissa increment",
        start_s=None if _is_response(function) else _in_seconds(function, float(function["abscissa_min"])),
        start_key="abscissa minimum",
        refusal=_refusal(function),
    )


def _refusal(function: Fields) -> str:
    if _is_response(function):
        return ""
    if function["ord_data_type"] in _COMPLEX:
        return "holds complex numbers, real numbers are needed; export the time record, not its spectrum"
    kind = function["abscissa_spec_data_type"]
    if kind not in _OF_TIME:
        return f"is a function of {_ABSCISSAE.get(kind, f'data type {kind}')}, one of time is needed"
    if function["abscissa_spacing"] != _EVEN:
        return (
            "has uneven abscissa spacing (record 7, field 3, is 0); resample it and export it evenly spaced"
        )
    return ""


def _period_s(function: Fields) -> float | None:
    """Return the abscissa's increment [s], if there is one and its label is none or a unit of time."""
    increment = float(function["abscissa_inc"])
    return _in_seconds(function, increment) if increment > 0.0 else None


def _in_seconds(function: Fields, value: float) -> float | None:
    try:
        unit = time_unit_of(_label(function, "abscissa_axis_units_lab") or "s")
        return float(convert_column(np.array([value]), unit, "s")[0])
    except ValueError:
        return None  # a label that is no unit says nothing


def _label(function: Fields, key: str) -> str:
    text = str(function.get(key, "")).strip()
    return "" if text.upper() == "NONE" else text


def _check_whole(path: Path) -> None:
    """Check that the last dataset has its end, a line with -1: pyuff silently drops one without it."""
    with path.open("rb") as file:
        head = file.read(512).lstrip()
        file.seek(-min(path.stat().st_size, 512), 2)
        tail = file.read().rstrip()
    if not head.startswith(b"-1"):
        raise ValueError("not a universal file (UFF): it must begin with a line -1")
    if not tail.endswith(b"-1"):
        raise ValueError("is cut off: its last dataset does not end with a line -1; export or copy it again")
