"""Compiled kernels: `numba.njit` with the signature kept for mypy and a cache that cannot be stale.

`fastmath` stays off (a kernel must keep NaN and the order of its sums); division by zero gives inf as in
numpy, so a kernel raises nothing and a status says what went wrong. A kernel takes plain scalars,
C-contiguous float64 arrays and NamedTuples of them.

numba keys its cache on the file of the kernel alone: edit a kernel in another file and callers that have
compiled it into themselves keep the old one. So the stamp of each cache is extended by the stamps of all
kernels called.
"""

from __future__ import annotations

from collections.abc import Callable
from types import CodeType
from typing import Any, ParamSpec, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

P = ParamSpec("P")
T = TypeVar("T")
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def kernel(function: Callable[P, T]) -> Callable[P, T]:
    """`function`, compiled at its first call for the types of its arguments and kept on disk."""
    compiled: Any = numba.njit(cache=True, fastmath=False, error_model="numpy")(function)
    stamps = [_stamp(compiled)] + [_stamp(callee) for callee in _callees(function)]
    # numba has no public way to say "this cache also depends on"; a test holds that this one works.
    compiled._cache._cache_file._source_stamp = "|".join(dict.fromkeys(stamps))
    result: Callable[P, T] = compiled
    return result


def _stamp(compiled: Any) -> str:
    stamp: Any = compiled._cache._cache_file._source_stamp
    return stamp.hex() if isinstance(stamp, bytes) else str(stamp)


def _callees(function: Callable[..., Any]) -> list[Any]:
    """The kernels among the global names of `function` (those further down its own file share its stamp)."""
    named = (function.__globals__.get(name) for name in _names(function.__code__))
    return [value for value in named if isinstance(value, numba.core.dispatcher.Dispatcher)]


def _names(code: CodeType) -> tuple[str, ...]:
    inner = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    return code.co_names + tuple(name for child in inner for name in _names(child))
