"""Models to and from plain tables of floats and lists (TOML), exact to the last bit, checked on the way in.

A table has the key `kind` and one key for each field of the model; a field with a default may be left out.
"""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError, nearest

ModelT = TypeVar("ModelT")
Table = dict[str, Any]


def table_of(model: Any, kind: str) -> Table:
    """Return `model`, a dataclass of floats and arrays, as `{"kind": kind, field: float | list}`."""
    values = {field.name: getattr(model, field.name) for field in dataclasses.fields(model) if field.init}
    plain = {name: v.tolist() if isinstance(v, np.ndarray) else float(v) for name, v in values.items()}
    return {"kind": kind, **plain}


def model_of(model: type[ModelT], kind: str, table: Table) -> ModelT:
    """Return the model in `table`. Raises InputError that names the key that is wrong, missing or unknown."""
    if table.get("kind") != kind:
        raise InputError(f'hysteresis table: kind is {table.get("kind")!r}, "{kind}" is needed here')
    fields = {field.name: field for field in dataclasses.fields(model) if field.init}  # type: ignore[arg-type]
    given = {key: value for key, value in table.items() if key != "kind"}
    for key in given.keys() - fields.keys():
        raise InputError(f'hysteresis table "{kind}": unknown key "{key}"{nearest(key, fields)}')
    for key, field in fields.items():
        if key not in given and field.default is dataclasses.MISSING:
            raise InputError(f'hysteresis table "{kind}": key "{key}" is missing')
    try:
        return model(**given)
    except (ValueError, TypeError) as error:
        raise InputError(f'hysteresis table "{kind}": {error}') from None


def own_array(model: Any, name: str, size: int | None = None) -> FloatArray:
    """Replace field `name` by the model's own C-contiguous float64 copy, finite, of shape (size,); return it.

    Not made read-only: numba compiles a second copy of every kernel for read-only arrays.
    """
    values = np.array(getattr(model, name), dtype=np.float64, order="C")
    if values.ndim != 1 or values.size == 0 or (size is not None and values.size != size):
        needed = "(n,)" if size is None else f"({size},)"
        raise ValueError(f"{name} must have shape {needed}, got {values.shape}")
    if not np.isfinite(values).all():
        raise ValueError(f"{name} must be finite, got {values.tolist()}")
    object.__setattr__(model, name, values)
    return values


def own_floats(model: Any, *names: str) -> None:
    """Check that the fields `names` are finite and store them as float (an int would compile anew)."""
    for name in names:
        value = getattr(model, name)
        number = isinstance(value, int | float | np.floating) and not isinstance(value, bool)
        if not (number and np.isfinite(value)):
            raise ValueError(f"{name} must be a finite number, got {value!r}")
        object.__setattr__(model, name, float(value))


def inputs(v: FloatArray) -> FloatArray:
    """Return `v` of shape (samples,) as kernels take it. Raises ValueError that names a sample that is not finite."""
    values = np.ascontiguousarray(v, dtype=np.float64)
    if values.ndim != 1:
        raise ValueError(f"the input must have shape (samples,), got {values.shape}")
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise ValueError(f"the input is {values[bad[0]]} at sample {bad[0]} of {values.size}; clean it first")
    return values
