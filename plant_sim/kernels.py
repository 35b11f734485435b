"""Compiled kernels and the records they read: one typed place where numba is met.

A kernel takes its parameters as a one-element structured array (a field a quantity), because a call with
few array arguments costs a fifth of one that unpacks a NamedTuple.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from rtctl.border.kernels import compiled_with

KernelT = TypeVar("KernelT", bound=Callable[..., Any])

Record = Any
"""A row of a structured array inside a kernel: `record.field`; numba knows its type, mypy does not."""


def compiled(function: KernelT) -> KernelT:
    """Return `function`, compiled by numba on its first call, cached on disk, with IEEE arithmetic as written."""
    return cast(KernelT, compiled_with(function, fastmath=False))


def direct(function: KernelT, *examples: Any) -> KernelT:
    """Compile a kernel for arguments of the types of `examples` only; nothing runs.

    Skips numba's look-up of the types at each call, which is 0.4 us where records are among them. The caller vouches
    for the types: an array of another type would be read as if it were the right one.
    """
    if not isinstance(function, numba.core.dispatcher.Dispatcher):  # NUMBA_DISABLE_JIT=1
        return function
    type_of: Any = numba.typeof
    signature = tuple(type_of(example) for example in examples)
    function.compile(signature)
    return cast(KernelT, function.get_overload(signature))


def pack(model: BaseModel) -> NDArray[Any]:
    """Return the numbers of `model` as a one-element structured array: the same names, nested tables nested.

    Floats become float64, whole numbers and enumerations int64; text and lists, of no use to a kernel, are left out.
    """
    layout = _layout(model)
    array = np.zeros(1, dtype=_LAYOUTS.setdefault(repr(layout), layout))
    array[0] = _values(model)
    return array


_LAYOUTS: dict[str, np.dtype[Any]] = {}
"""One dtype object per layout: numba recognises an object at once, an equal one only by a slow comparison."""


def _numbers(model: BaseModel) -> list[tuple[str, Any]]:
    return [(name, value) for name, value in model if not isinstance(value, str | tuple)]


def _layout(model: BaseModel) -> np.dtype[Any]:
    return np.dtype([(name, _field_type(value)) for name, value in _numbers(model)])


def _field_type(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return _layout(value)
    return np.float64 if isinstance(value, float) else np.int64


def _values(model: BaseModel) -> tuple[Any, ...]:
    return tuple(_values(value) if isinstance(value, BaseModel) else value for _, value in _numbers(model))
