"""Kernels of a model, compiled from generated source and kept on disk under its hash.

A model is compiled once on a machine, in less than a second, and loaded in a twentieth of it afterwards. One kernel
that interprets any model's instructions needs no such time, but took 9 to 13 times as long a step (measured: two
states, 1 to 16 lanes).
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numba
import numpy as np

from plant_sim.equations.compiled.adaptive import DONE, SHORTEST, TOO_MANY, adapt
from plant_sim.equations.compiled.crossing import (
    MOST_EVENTS,
    Laws,
    Step,
    extrapolate_with_events,
    make_scratch,
    read_only,
    with_kernels,
)
from plant_sim.equations.compiled.explicit import noticing_source, rates_source, rk4_source
from plant_sim.equations.compiled.implicit import derive_source, extrapolate
from plant_sim.equations.compiled.own_functions import at_many, functions_in, many_source, registered
from plant_sim.equations.compiled.passing import guards_source, resets_source, sides_at
from plant_sim.equations.integration.steps import Plan
from plant_sim.equations.system import System
from plant_sim.oscillator.equation.binding import CONTRACT
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import first_class
from rtctl.border.machine_code import cache as kernel_cache
from rtctl.border.machine_code.generated import compiled, made

FUNCTIONS = (
    "sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "fabs",
)  # fmt: skip
_lock = threading.RLock()


# 8 parameters because a record is an array and a number for each of these
def march(  # noqa: PLR0913
    system: System,
    start: FloatArray,
    nodes: FloatArray,
    period_s: float,
    how: Plan,
    p: FloatArray,
    start_s: float = 0.0,
    side: FloatArray | None = None,
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
        side: Signs (events, lanes) of what the model's events watch, so far; brought up to date. None: of the start.

    Raises:
        ValueError: Events follow each other without end.
    """
    low, high = (np.array([getattr(one, word) for one in system.states]) for word in ("low", "high"))
    x, out = _begun(start, low, high, nodes.shape[1] // how.substeps)
    step_s = period_s / how.substeps
    with _lock:  # numba loads one kernel at a time
        kernel = law_of(system) if how.implicit else _integrator(system)
        laws = _with_events(system) if system.events else None
    if laws is not None and len(out) > 1:
        side = sides_at(system, x, nodes[0, 0], start_s, p) if side is None else side
        nodes, endless = read_only(nodes), np.zeros(2)
        if how.implicit:
            ends = extrapolate_with_events(  # type: ignore[call-arg]  # mypy does not count what * stands for
                *laws, x, nodes, step_s, how.substeps, start_s, p, low, high, side, endless, out
            )
        else:
            ends = kernel(x, nodes, step_s, how.substeps, start_s, p, out, low, high, side, *laws, endless)
        if not ends:
            raise ValueError(_endless(system, endless, step_s))
    elif how.implicit:
        extrapolate(kernel, x, nodes, step_s, how.substeps, start_s, p, low, high, out)
    else:
        kernel(x, nodes, step_s, how.substeps, start_s, p, out)
    return out


# 7 parameters because a record is an array and a number for each of these
def march_adaptively(  # noqa: PLR0913
    system: System, start: FloatArray, nodes: FloatArray, period_s: float, how: Plan, p: FloatArray, most: int
) -> tuple[FloatArray, int]:
    """Return what `march` does of a model without events, by steps whose lengths follow the motion, and their number.

    Raises:
        ValueError: A lane takes `most` steps, or steps that are too short.
    """
    low, high = (np.array([getattr(one, word) for one in system.states]) for word in ("low", "high"))
    x, out = _begun(start, low, high, nodes.shape[1] // how.substeps)
    ended, step_s = np.zeros(1), period_s / how.substeps
    with _lock:
        kernel = law_of(system)
    code, steps = adapt(
        kernel, x, nodes, step_s, how.substeps, 0.0, p, low, high, how.tolerance, most, out, ended
    ).tolist()
    if code != DONE:
        reason = f"{most} steps in all" if code == TOO_MANY else f"steps below {SHORTEST * step_s:.1g} s"
        raise ValueError(
            f"the model is stiff, and {reason} do not resolve it at t = {ended[0]:.6g} s. Something in a rate jumps "
            "there, such as a sign or a square root whose argument passes through 0: smooth it (sqrt(abs(d) + eps)), "
            "or leave it out"
        )
    return out, steps


def compiled_at_many(
    function: Callable[..., Any], arguments: Sequence[str], members: Sequence[str], owner: str
) -> tuple[str, Callable[[FloatArray], FloatArray]]:
    """Return the symbol of a user's function, and what computes it at many places: (arguments, n) to (members, n).

    Raises:
        ValueError: It depends on what no kernel can contain.
    """
    symbol = registered(function)
    source = many_source(symbol, len(arguments), len(members))
    return symbol, at_many(_many(source), members, owner)


@lru_cache(maxsize=64)
def _many(source: str) -> Any:
    return _cached(source, "many", source, {})


def _endless(system: System, endless: FloatArray, step_s: float) -> str:
    """Return the message on an event that takes place again and again, and its time [s] (2,)."""
    name = system.events[int(endless[0])].name
    return (
        f"the event {name} takes place again and again at t = {endless[1]:.6g} s: more than {MOST_EVENTS} events in a "
        f"step of {step_s:.3g} s; let it end, by a state that says that the motion rests, or by two levels that are "
        "further apart"
    )


@lru_cache(maxsize=64)
def _integrator(system: System) -> Any:
    """Return the compiled integrator of a model; a device asks for it at each of its samples."""
    return _rk4(rates_source(system), rk4_source(system), noticing_source(system))


@lru_cache(maxsize=64)
def law_of(system: System) -> Any:
    """Return the compiled law of a model, `derive` of `plant_sim.equations.compiled.implicit`, as kernels call it."""
    return _law(derive_source(system), "derive")


@lru_cache(maxsize=64)
def laws_of(system: System) -> Laws:
    """Return the compiled laws of a model with events."""
    return Laws(
        law_of(system),
        _law(guards_source(system), "guards"),
        _law(resets_source(system), "resets"),
        np.array([float(one.direction) for one in system.events]),
    )


@lru_cache(maxsize=64)
def _with_events(system: System) -> tuple[Any, ...]:
    """Return the laws of a model with events as integrators take them."""
    return with_kernels(laws_of(system))


def _begun(
    start: FloatArray, low: FloatArray, high: FloatArray, intervals: int
) -> tuple[FloatArray, FloatArray]:
    """Return the states (states, lanes) within their limits (states,), and the output whose first row they are."""
    x = np.ascontiguousarray(np.clip(start, low[:, None], high[:, None]))
    out = np.empty((intervals + 1, *x.shape))
    out[0] = x
    return x, out


@lru_cache(maxsize=512)
def _rk4(rates: str, integrator: str, noticing: str = "") -> Any:
    """Return the compiled integrator; `noticing` is the source of what its events watch."""
    inlined = numba.njit(error_model="numpy", fastmath=CONTRACT, forceinline=True, nogil=True)
    known: dict[str, Any] = {"rates": inlined(_made(rates, "rates"))}
    whole = rates + integrator + noticing
    if noticing:
        whole += str(kernel_cache.stamp_of(make_scratch))
        known |= {"guards": inlined(_made(noticing, "guards")), "np": np}
        known |= {"Step": Step, "make_scratch": make_scratch}
    return _cached(integrator, "rk4", whole, known)


@lru_cache(maxsize=512)
def _law(source: str, name: str) -> Any:
    """Return a compiled law as a value that a kernel can call."""
    law = _cached(source, name, source, {})
    return first_class(law, np.empty(1), np.empty(1), 0.0, np.empty((1, 1)), 0, np.empty(1))


def _cached(source: str, name: str, whole: str, known: dict[str, Any]) -> Any:
    """Return a function of a generated source, compiled when it is called, kept on disk by the hash of `whole`."""
    function = _made(source, name, known)
    return compiled(function, whole, __file__, __name__, error_model="numpy", fastmath=CONTRACT, nogil=True)


def _made(source: str, name: str, known: Mapping[str, Any] | None = None) -> Any:
    """Return the function of a generated source, which is made of trees and holds no text of a user."""
    names: dict[str, Any] = {one: getattr(math, one) for one in FUNCTIONS}
    return made(source, name, {**names, "floor": np.floor, **functions_in(source), **(known or {})}, __name__)
