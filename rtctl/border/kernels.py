"""Compiled kernels: `numba.njit` with the signature kept for mypy and a cache that cannot be stale.

`fastmath` stays off (a kernel must keep NaN and the order of its sums); division by zero gives inf as in
numpy, so a kernel raises nothing and a status says what went wrong. A kernel takes plain scalars, C-contiguous
float64 arrays and NamedTuples of them. It is compiled into its callers: left to itself LLVM calls some, and each
call counts references on every array of a NamedTuple, which made the observer three times as slow.

numba keys its cache on the file of the kernel alone: edit a kernel in another file and callers that have
compiled it into themselves keep the old one. So the stamp of each cache is extended by those of all kernels,
NamedTuples and constants in the kernel's module, and of this file. Import them by name, above the kernels.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable, Iterator
from enum import Enum
from functools import lru_cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numba
import numpy as np
from numba.core import cgutils
from numba.core.ccallback import CFunc
from numba.extending import intrinsic

from rtctl.border.arrays import FloatArray
from rtctl.border.machine_code import cache as kernel_cache

P = ParamSpec("P")
T = TypeVar("T")


def kernel(function: Callable[P, T]) -> Callable[P, T]:
    """Compile `function` at its first call for the types of its arguments, and keep it on disk."""
    return _compiled(function)


def background_kernel(function: Callable[P, T]) -> Callable[P, T]:
    """Compile a kernel of whole records that releases the interpreter's lock; for single samples that does not pay."""
    return _compiled(function, nogil=True)


def called_kernel(function: Callable[P, T]) -> Callable[P, T]:
    """Compile a kernel that is called: compiled into its callers, as others are, many of them take half a minute."""
    return compiled_with(function, fastmath=False, error_model="numpy", nogil=True)


def _compiled(function: Callable[P, T], *, nogil: bool = False) -> Callable[P, T]:
    return compiled_with(function, fastmath=False, error_model="numpy", forceinline=True, nogil=nogil)


def compiled_with(function: Callable[P, T], **options: Any) -> Callable[P, T]:
    """Compile `function` at its first call with options of `numba.njit`; its cache depends on all that it contains."""
    compiled = kernel_cache.jit(function, **options)
    _take_any_number(compiled)
    # numba has no public way to say "this cache also depends on"; a test holds that this one works.
    own = kernel_cache.stamp_of(compiled)
    if own is not None:
        kernel_cache.stamp(compiled, "|".join([own, *sorted({_file_stamp(__name__), *_parts(function)})]))
    result: Callable[P, T] = compiled
    return result


def _take_any_number(compiled: Any) -> None:
    """Compile a kernel once for all numbers; numba compiles it for each number that stands in a caller's source."""
    if not hasattr(compiled, "get_call_template"):  # NUMBA_DISABLE_JIT=1
        return
    of_numba: Any = numba
    ask, unliteral = compiled.get_call_template, of_numba.types.unliteral

    def ask_for_types(arguments: Any, keywords: Any) -> Any:
        return ask(tuple(map(unliteral, arguments)), {key: unliteral(one) for key, one in keywords.items()})

    compiled.get_call_template = ask_for_types


def _pointer(typing_context: Any, address: Any) -> Any:
    """Convert an address to a pointer, of which `carray` makes an array (in a kernel)."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], cgutils.voidptr_t)

    return numba.types.voidptr(address), generate


pointer: Any = intrinsic(_pointer)


def machine_code(kernel: Callable[P, T], *examples: Any) -> Callable[P, T]:
    """Return `kernel` compiled for the types of `examples` only: made now or taken from the disk, nothing runs.

    Skips numba's look-up of the types at each call. The caller vouches for them: another one would be misread.
    """
    if not hasattr(kernel, "get_overload"):  # NUMBA_DISABLE_JIT=1
        return kernel
    type_of: Any = numba.typeof
    signature = tuple(type_of(example) for example in examples)
    compiled: Any = kernel
    compiled.compile(signature)
    code: Callable[P, T] = compiled.get_overload(signature)
    return code


def first_class(kernel: Callable[..., int], *examples: Any) -> Any:
    """Return `kernel`, which returns an integer, as a value that other kernels can call."""
    of_numba: Any = numba
    arguments = tuple(of_numba.typeof(example) for example in examples)
    dispatcher: Any = kernel
    found: Any = CFunc(
        dispatcher.py_func,
        (arguments, of_numba.int64),
        locals={},
        options={"nogil": True, "error_model": "numpy", "fastmath": False},
    )
    own = kernel_cache.stamp_of(dispatcher)
    if own is not None:  # else there is no place for a cache
        found.enable_caching()
        kernel_cache.stamp(found, own)
    found.compile()
    return found


def _parts(function: Callable[..., Any]) -> Iterator[str]:
    """Return stamps of all that the module of `function` has imported or defined and may compile into it.

    All of it, not only the names in `function`: it may reach them through a kernel further down its file.
    """
    for value in function.__globals__.values():
        if isinstance(value, numba.core.dispatcher.Dispatcher):
            yield kernel_cache.stamp_of(value) or _file_stamp(value.py_func.__module__)
        elif isinstance(value, type) and issubclass(value, tuple | Enum):
            yield _file_stamp(value.__module__)
    yield from constants(function)


def constants(function: Callable[..., Any]) -> Iterator[str]:
    """Return names and values of the numbers, texts and arrays that numba compiles into `function`."""
    for name, value in function.__globals__.items():
        if isinstance(value, np.ndarray):
            yield f"{name} {value.dtype} {hashlib.sha256(value.tobytes()).hexdigest()}"
        elif not name.startswith("__") and _is_constant(value):
            yield f"{name} = {value!r}"


def _is_constant(value: Any) -> bool:
    """Return whether numba would compile a global into a kernel as a number or a text."""
    if isinstance(value, tuple):
        return all(_is_constant(one) for one in value)
    return isinstance(value, int | float | complex | str | np.generic | np.dtype)


@lru_cache
def _file_stamp(module: str) -> str:
    source = sys.modules[module].__file__
    return hashlib.sha256(Path(source).read_bytes()).hexdigest() if source else module


_of_numba: Any = numba  # which mypy knows by half
carray = _of_numba.carray
COMPILED = not _of_numba.config.DISABLE_JIT


@kernel
def uncounted(array: FloatArray) -> FloatArray:
    """Return the same numbers without reference counting, on which loops with branches spend a third (in a kernel).

    Only for an argument of the outermost kernel: `array` must outlive it. C-contiguous float64.
    """
    if not COMPILED:
        return array
    view: FloatArray = carray(pointer(array.ctypes.data), array.shape, np.float64)
    return view
