"""A template kernel bound to an acceleration law: compiled together, cached on disk under both names.

`bind(rk4, acceleration=relaxing)` is a copy of `rk4` whose global `acceleration` is the compiled `relaxing`. So
the loop of the integrator exists once in the source and is as fast for each law as if written for it; a law is
compiled once on a machine, whatever combinations a user tries. numba follows the file of the template alone, so
the cache is stamped with the sources of the laws as well.
"""

from __future__ import annotations

import hashlib
import inspect
import re
from collections.abc import Callable
from pathlib import Path
from types import FunctionType
from typing import Any

import numba

from rtctl.border.kernels import constants
from rtctl.border.machine_code import cache as kernel_cache

CONTRACT = {"contract"}
"""The only freedom of the compiler: a*b + c as one rounded operation, as a C compiler takes by default."""

LONGEST_NAME = 120
"""Longest name of a bound kernel, which becomes that of a file in numba's cache."""


def law(function: Callable[..., Any]) -> Any:
    """Return `function`, compiled for inlining into templates and other laws."""
    return numba.njit(error_model="numpy", fastmath=CONTRACT, forceinline=True, nogil=True)(function)


def bind(template: Callable[..., Any], *, inline: bool = False, **laws: Any) -> Any:
    """Return a copy of `template`, a plain Python function, with the globals named in `laws` replaced; compiled lazily.

    `inline`: it is itself a law that goes into another template.
    """
    name = "__".join([template.__name__, *(_name(bound) for bound in laws.values())])
    if len(name) > LONGEST_NAME:
        name = f"{name[:LONGEST_NAME]}_{hashlib.sha256(name.encode()).hexdigest()[:12]}"
    code = template.__code__.replace(co_name=name, co_qualname=name)
    copy = FunctionType(code, {**template.__globals__, **laws}, name, template.__defaults__)
    copy.__module__ = template.__module__
    copy.__qualname__ = name
    compiled = kernel_cache.jit(copy, error_model="numpy", fastmath=CONTRACT, nogil=True, forceinline=inline)
    kernel_cache.stamp(compiled, _stamp([template, *laws.values()]))
    return compiled


def _name(bound: Any) -> str:
    """Return the part of a bound kernel's name, and so of its cache's, that says what it was bound to."""
    function = getattr(bound, "py_func", bound)
    if not isinstance(function, FunctionType):
        return re.sub(r"\W+", "_", repr(bound)).strip("_")
    return f"{function.__module__.rpartition('.')[2]}_{function.__name__}"


def _stamp(functions: list[Any]) -> str:
    """Return a stamp of the sources of a compiled kernel: the functions' modules and those of what they call."""
    seen: set[int] = set()
    files: set[str] = set()
    values: set[str] = set()
    pending = [getattr(function, "py_func", function) for function in functions]
    while pending:
        function = pending.pop()
        if not isinstance(function, FunctionType) or id(function) in seen:
            continue  # a bound constant: its value is in the name
        seen.add(id(function))  # not its file: copies of one template differ in what they were bound to
        files.add(inspect.getsourcefile(function) or "")
        values |= set(constants(function))  # those of other files, too
        pending += [
            value.py_func
            for value in function.__globals__.values()
            if isinstance(value, numba.core.dispatcher.Dispatcher)
        ]
    contents = sorted(hashlib.sha256(Path(file).read_bytes()).hexdigest() for file in files if file)
    return hashlib.sha256("|".join([*contents, *sorted(values)]).encode()).hexdigest()
