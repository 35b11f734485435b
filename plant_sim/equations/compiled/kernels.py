"""Kernels of a model, compiled from generated source and kept on disk under its hash.

A model is compiled once on a machine, in less than a second, and loaded in a twentieth of it afterwards. One kernel
that interprets any model's instructions needs no such time, but took 9 to 13 times as long a step (measured: two
states, 1 to 16 lanes).
"""

from __future__ import annotations

import hashlib
import math
import threading
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba
import numpy as np

from plant_sim.equations.compiled.explicit import rates_source, rk4_source
from plant_sim.equations.compiled.implicit import derive_source, extrapolate
from plant_sim.equations.integration.steps import Plan
from plant_sim.equations.system import System
from plant_sim.oscillator.equation.binding import CONTRACT
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import first_class
from rtctl.border.machine_code import cache as kernel_cache

FUNCTIONS = (
    "sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "fabs",
)  # fmt: skip
_lock = threading.RLock()


# 7 parameters because a record is an array and a number for each of these
def march(
    system: System,
    start: FloatArray,
    nodes: FloatArray,
    period_s: float,
    how: Plan,
    p: FloatArray,
    start_s: float = 0.0,
) -> FloatArray:
    """Return the states (samples, states, lanes) of a record, by Runge-Kutta steps or by those for stiff models.

    Args:
        system: The model.
        start: States (states, lanes) at the first sample [SI].
        nodes: Inputs (3, steps, inputs) at the start, middle and end of each step [SI].
        period_s: Sample period [s].
        how: Steps between two samples, and of which kind.
        p: Parameters (parameters, lanes) [SI].
        start_s: Time at the first sample [s].
    """
    x, out = _begun(system, start, nodes.shape[1] // how.substeps)
    step_s = period_s / how.substeps
    with _lock:  # numba loads one kernel at a time
        kernel = law_of(system) if how.implicit else _integrator(system)
    if not how.implicit:
        kernel(x, nodes, step_s, how.substeps, start_s, p, out)
        return out
    low, high = (np.array([getattr(one, word) for one in system.states]) for word in ("low", "high"))
    extrapolate(kernel, x, nodes, step_s, how.substeps, start_s, p, low, high, out)
    return out


@lru_cache(maxsize=64)
def _integrator(system: System) -> Any:
    """Return the compiled integrator of a model; a device asks for it at each of its samples."""
    return _rk4(rates_source(system), rk4_source(system))


@lru_cache(maxsize=64)
def law_of(system: System) -> Any:
    """Return the compiled law of a model, `derive` of `plant_sim.equations.compiled.implicit`, as kernels call it."""
    return _derive(derive_source(system))


def _begun(system: System, start: FloatArray, intervals: int) -> tuple[FloatArray, FloatArray]:
    """Return the states (states, lanes) within their limits, and the output whose first row they are."""
    low, high = (np.array([[getattr(one, word)] for one in system.states]) for word in ("low", "high"))
    x = np.ascontiguousarray(np.clip(start, low, high))
    out = np.empty((intervals + 1, *x.shape))
    out[0] = x
    return x, out


@lru_cache(maxsize=512)
def _rk4(rates: str, integrator: str) -> Any:
    """Return the compiled integrator."""
    law = numba.njit(error_model="numpy", fastmath=CONTRACT, forceinline=True, nogil=True)(
        _made(rates, "rates")
    )
    return _cached(integrator, "rk4", rates + integrator, {"rates": law})


@lru_cache(maxsize=512)
def _derive(source: str) -> Any:
    """Return the compiled law as a value that a kernel can call."""
    law = _cached(source, "derive", source, {})
    return first_class(law, np.empty(1), np.empty(1), 0.0, np.empty((1, 1)), 0, np.empty(1))


def _cached(source: str, name: str, whole: str, laws: dict[str, Any]) -> Any:
    """Return a function of a generated source, compiled when it is called, kept on disk by the hash of `whole`."""
    function = _made(source, name)
    digest = hashlib.sha256(f"{whole}|{_own_stamp()}".encode()).hexdigest()
    unique = f"{name}_{digest[:32]}"
    # numba finds its folder by the file of a function: it is said to stand in this one
    function.__code__ = function.__code__.replace(co_filename=__file__, co_name=unique, co_qualname=unique)
    function.__module__, function.__name__, function.__qualname__ = __name__, unique, unique
    function.__globals__.update(laws)
    compiled = kernel_cache.jit(function, error_model="numpy", fastmath=CONTRACT, nogil=True)
    kernel_cache.stamp(compiled, digest)
    return compiled


def _made(source: str, name: str) -> Any:
    """Return the function of a generated source, which is made of trees and holds no text of a user."""
    names: dict[str, Any] = {name: getattr(math, name) for name in FUNCTIONS}
    names |= {"floor": np.floor, "__name__": __name__}
    exec(compile(source, "<equations>", "exec"), names)
    return names[name]


@lru_cache(maxsize=1)
def _own_stamp() -> str:
    return hashlib.sha256(Path(__file__).read_bytes()).hexdigest()
