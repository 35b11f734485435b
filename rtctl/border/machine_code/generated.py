"""Functions of generated source: compiled when they are called, kept on the disk by a stamp of all that is in them."""

from __future__ import annotations

import hashlib
import linecache
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from types import FunctionType
from typing import Any

from rtctl.border.machine_code import cache as kernel_cache


def made(source: str, name: str, names: Mapping[str, Any], module: str, *, readable: bool = False) -> Any:
    """Return the function `name` of a source, as plain Python.

    Args:
        source: Source of one function, which holds no text of a user.
        name: Its name.
        names: What the names in it stand for.
        module: Module that it is said to belong to.
        readable: Whether `inspect` finds its source, which is kept in memory for that.
    """
    place = f"<{name} {hashlib.sha256(source.encode()).hexdigest()[:16]}>"
    if readable:
        linecache.cache[place] = (len(source), None, source.splitlines(keepends=True), place)
    known = {**names, "__name__": module}
    exec(compile(source, place, "exec"), known)
    return known[name]


def compiled(function: FunctionType, whole: str, home: str, module: str, **options: Any) -> Any:
    """Return a function compiled at its first call.

    Args:
        function: Function of a generated source.
        whole: Text of all that is compiled into it; the file of `home` counts too.
        home: File of the module whose cache it goes to: numba finds the folder by the file of a function.
        module: Name of that module.
        options: Of `numba.njit`.
    """
    digest = hashlib.sha256(f"{whole}|{_digest(home)}".encode()).hexdigest()
    unique = f"{function.__name__}_{digest[:32]}"
    function.__code__ = function.__code__.replace(co_filename=home, co_name=unique, co_qualname=unique)
    function.__module__, function.__name__, function.__qualname__ = module, unique, unique
    found = kernel_cache.jit(function, **options)
    kernel_cache.stamp(found, digest)
    return found


@lru_cache
def _digest(file: str) -> str:
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()
