"""Functions of a user's class, compiled into the kernels of its model, and known by a digest of all that they contain.

A kernel's source calls such a function by its symbol, so a kernel that is kept on disk belongs to one text of it.
"""

from __future__ import annotations

import hashlib
import math
import re
import types
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numba
import numpy as np
from numba.core.errors import NumbaError
from numba.extending import overload

from plant_sim.oscillator.equation.binding import CONTRACT
from rtctl.border.arrays import FloatArray

SYMBOL = re.compile(r"\bown_[0-9a-f]{24}\b")
_known: dict[str, Any] = {}
"""Compiled functions by their symbols."""


def registered(function: Any) -> str:
    """Return the symbol of a function, by which kernels call it.

    Raises:
        ValueError: It depends on something that no kernel can contain.
    """
    symbol = f"own_{hashlib.sha256(repr(list(_contents(function, set()))).encode()).hexdigest()[:24]}"
    if symbol not in _known:
        _known[symbol] = _returning_numbers(_compiled(function, {}))
    return symbol


def functions_in(source: str) -> dict[str, Any]:
    """Return the compiled functions that a kernel's source calls, by symbol."""
    return {symbol: _known[symbol] for symbol in SYMBOL.findall(source)}


def many_source(symbol: str, arguments: int, members: int) -> str:
    """Return the source of `many(a, out) -> 0`, which calls a function at each column of `a` (arguments, n)."""
    given = ", ".join(f"a[{k}, i]" for k in range(arguments))
    made = "".join(f"out[{k}, i], " for k in range(members))
    return f"def many(a, out):\n    for i in range(a.shape[1]):\n        {made}= {symbol}({given})\n    return 0\n"


def at_many(compiled: Any, members: Sequence[str], owner: str) -> Callable[[FloatArray], FloatArray]:
    """Return a function of (arguments, n) that returns (members, n), from the compiled `many`.

    It raises ValueError, in words that begin with `owner`, where the user's function does not compile.
    """

    def values(given: FloatArray) -> FloatArray:
        out = np.empty((len(members), given.shape[1]))
        try:
            compiled(given, out)
        except NumbaError as error:
            if "failed to unpack" in str(error) or "wrong tuple length" in str(error):
                wanted = f"{len(members)} number{'s' if len(members) > 1 else ''}: {', '.join(members)}"
                raise ValueError(f"{owner} must return {wanted}") from None
            raise ValueError(f"{owner} does not compile: {_first_words(error)}") from None
        return out

    return values


def _first_words(error: NumbaError) -> str:
    """Return what numba says of the user's code, without its own frames."""
    said = [line.strip() for line in re.sub(r"\x1b\[[0-9;]*m", "", str(error)).splitlines()]
    useful = [line for line in said if line and not line.startswith(("Failed in", "During:", "- Resol"))]
    return " ".join(useful[:4])


def _numbers(returned: Any) -> Any:
    """Return a tuple of what a function returns, which of one number may be that number."""
    return returned if isinstance(returned, tuple) else (returned,)


@overload(_numbers)  # numba compares argument by argument, and takes an annotation for a difference
def _numbers_of(returned):  # type: ignore[no-untyped-def]
    if isinstance(returned, numba.types.BaseTuple):
        return lambda returned: returned
    return lambda returned: (returned,)


def _returning_numbers(function: Any) -> Any:
    """Return a compiled function that returns a tuple whatever `function` returns."""

    def returning(*given: float) -> Any:
        return _numbers(function(*given))

    return _inlined(returning)


def _compiled(function: types.FunctionType, made: dict[types.FunctionType, Any]) -> Any:
    """Return a function compiled, and with it the plain Python functions of its module that it calls."""
    if function in made:
        raise ValueError(f"{function.__name__} calls itself; a loop can be compiled")
    made[function] = None
    known = dict(function.__globals__)
    for name, value in _globals_of(function):
        if isinstance(value, types.FunctionType):
            known[name] = made.get(value) or _compiled(value, made)
    copy = types.FunctionType(
        function.__code__, known, function.__name__, function.__defaults__, function.__closure__
    )
    made[function] = _inlined(copy)
    return made[function]


def _inlined(function: Callable[..., Any]) -> Any:
    of_numba: Any = numba
    return of_numba.njit(error_model="numpy", fastmath=CONTRACT, forceinline=True, nogil=True)(function)


def _globals_of(function: types.FunctionType) -> Iterator[tuple[str, Any]]:
    """Return the global names that the code of a function reads, with their values."""
    for name in sorted(_names(function.__code__)):
        if name in function.__globals__:
            yield name, function.__globals__[name]


def _names(code: types.CodeType) -> set[str]:
    return set(code.co_names).union(
        *(_names(one) for one in code.co_consts if isinstance(one, types.CodeType))
    )


def _contents(function: types.FunctionType, seen: set[types.FunctionType]) -> Iterator[Any]:
    """Return all on which the compiled code of a function depends, as texts and bytes."""
    seen.add(function)
    yield from _code(function.__code__)
    yield repr(function.__defaults__)
    cells = [cell.cell_contents for cell in function.__closure__ or ()]
    for name, value in (*_globals_of(function), *zip(function.__code__.co_freevars, cells, strict=True)):
        yield name
        of_python = getattr(value, "py_func", value)
        if isinstance(of_python, types.FunctionType):
            if of_python not in seen:
                yield from _contents(of_python, seen)
        elif isinstance(value, np.ndarray):
            yield (
                str(value.dtype),
                value.shape,
                hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest(),
            )
        elif isinstance(value, types.ModuleType):
            yield value.__name__
        elif (
            isinstance(value, int | float | str | tuple | np.number)
            or value is None
            or value in vars(math).values()
        ):
            yield repr(value)
        elif callable(value):
            yield f"{getattr(value, '__module__', '')}.{getattr(value, '__qualname__', value)}"
        else:
            raise ValueError(
                f"{function.__name__} reads the global {name}, a {type(value).__name__}; a compiled function may read "
                "numbers, tuples, NumPy arrays, modules and functions"
            )


def _code(code: types.CodeType) -> Iterator[Any]:
    yield code.co_code, code.co_names, code.co_varnames
    for one in code.co_consts:
        if isinstance(one, types.CodeType):
            yield from _code(one)
        else:
            yield repr(one)
