"""Optional dependencies: which extra of the package installs a module, and what a user reads where it is missing."""

from __future__ import annotations

import functools
import logging
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import NamedTuple

from rtctl.border.errors import InputError


class Extra(NamedTuple):
    """An optional dependency and the extra that installs it."""

    distribution: str
    """Name of the distribution on the package index."""
    extra: str
    """Name of the extra in `pyproject.toml`."""


EXTRAS = {
    "nptdms": Extra("npTDMS", "readers"),
    "pyuff": Extra("pyuff", "readers"),
    "h5py": Extra("h5py", "readers"),
    "asammdf": Extra("asammdf", "mdf"),
    "matplotlib": Extra("matplotlib", "plots"),
    "distributed": Extra("distributed", "cluster"),
    "mcap": Extra("mcap", "mcap"),
    "fmpy": Extra("fmpy", "fmu"),
    "caproto": Extra("caproto", "epics"),
    "pandas": Extra("pandas", "pandas"),
    "pyvisa": Extra("pyvisa", "visa"),
    "qcodes": Extra("qcodes", "qcodes"),
    "pymeasure": Extra("pymeasure", "pymeasure"),
}
"""Optional dependencies by the module that they provide."""


def require(module: str, purpose: str) -> ModuleType:
    """Import an optional dependency.

    Args:
        module: Name of the module, a key of `EXTRAS`.
        purpose: What needs it, such as "reading .tdms"; the message begins with it.

    Returns:
        The imported module.

    Raises:
        InputError: The module is not installed; the message names the extra that installs it.
    """
    try:
        return import_module(module)
    except ImportError:
        raise InputError(missing_message(module, purpose)) from None


def missing_message(module: str, purpose: str) -> str:
    """Return the message that names the missing distribution and its extra."""
    distribution, extra = EXTRAS[module]
    return f"{purpose} needs {distribution}: pip install 'rtctl[{extra}]'"


def can_draw() -> bool:
    """Return whether figures can be drawn; log a warning once if they cannot, since files then have none."""
    if find_spec("matplotlib") is not None:
        return True
    _warn_once(f"no figures are written: {missing_message('matplotlib', 'drawing')}")
    return False


@functools.cache
def _warn_once(message: str) -> None:
    logging.getLogger("rtctl").warning(message)
