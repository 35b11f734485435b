"""A strongly nonlinear Duffing oscillator, a multisine, and its motion by SciPy between the drive's own breakpoints."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.simulation import OscillatorSimulation
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Stimulus

FloatArray = NDArray[np.float64]
DAMPING, STIFFNESS, CUBIC, GAIN = 4.0, 8882.6, 6.0e5, 300.0
NOMINAL = {
    "damping": (DAMPING, "1/s"),
    "stiffness": (STIFFNESS, "1/s^2"),
    "stiffness_cubic": (CUBIC, "1/(mm^2*s^2)"),
    "drive_gain": (GAIN, "mm/s^2/V"),
}
UNITS = {"drive": "V", "displacement": "mm"}
PERIOD_S = 1.0 / 900.0
"""60 samples in a period of the linear resonance, 15 Hz."""
SAMPLES = 301
Z_0, V_0 = 0.06, -4.0
"""Start [mm, mm/s]: nothing is at rest, so that no mechanism can hide in it."""
OPTIONS: dict[str, Any] = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-11}

Drive = Callable[[float], float]
"""u(t) on one piece between breakpoints."""


def model(*mechanisms: tuple[str, Mapping[str, tuple[float, str]]], **nominal: float) -> ModelFile:
    """A model file with `mechanisms` (id, values with units); `nominal` replaces values of `NOMINAL`."""

    def table(values: Mapping[str, tuple[float, str]]) -> dict[str, dict[str, object]]:
        return {name: {"value": value, "unit": unit} for name, (value, unit) in values.items()}

    nominal_values = {name: (nominal.get(name, value), unit) for name, (value, unit) in NOMINAL.items()}
    extensions = [{"id": name, "parameters": table(values)} for name, values in mechanisms]
    kind = {"kind": "oscillator", "parameters": table(nominal_values), "mechanisms": extensions}
    return ModelFile.model_validate({"model": kind})


def simulation(*mechanisms: str, **nominal: float) -> OscillatorSimulation:
    """Of the Duffing oscillator with these mechanisms at neutral."""
    return oscillator_simulation(model(**nominal), UNITS, "test").extended(mechanisms)


def lane(bound: OscillatorSimulation, values: Mapping[str, float]) -> FloatArray:
    """Parameters of `bound` with `values` by their full names, all of which must exist."""
    names = [parameter.name for parameter in bound.parameters]
    own = np.array([parameter.value for parameter in bound.parameters])
    for name, value in values.items():
        own[names.index(name)] = value
    return own


def multisine(samples: int = SAMPLES, *, odd: bool = False) -> FloatArray:
    """Four tones from 4 to 19 Hz [V]; `odd`: sines of whole half-periods, which go on point-symmetrically."""
    t = PERIOD_S * np.arange(samples)
    if odd:
        base = math.pi / t[-1]
        return 1.1 * np.sin(3 * base * t) + 0.9 * np.sin(7 * base * t) - 0.8 * np.sin(11 * base * t)
    tones = ((4.1, 0.3, 1.2), (8.9, 1.9, 0.9), (14.3, -0.8, 0.8), (18.7, 2.6, 1.3))
    return sum(amplitude * np.cos(2 * np.pi * f * t + phase) for f, phase, amplitude in tones)


def stimulus(samples: FloatArray, hold: str = "linear") -> Stimulus:
    """A record with this drive from the usual start."""
    return Stimulus(
        inputs={"drive": samples},
        holds={"drive": hold},
        period_s=PERIOD_S,
        initial={"displacement": Z_0, "velocity": V_0},
    )


def duffing(z: float, v: float, u: float) -> float:
    """z'' of the nominal model."""
    return GAIN * u - DAMPING * v - STIFFNESS * z - CUBIC * z**3


def held(samples: FloatArray, hold: str, at: float) -> Drive:
    """The drive on the piece around the time `at`; before the first sample it is that, after the last one the last."""
    k = math.floor(at / PERIOD_S)
    before, after = (float(samples[min(max(i, 0), len(samples) - 1)]) for i in (k, k + 1))
    if hold == "zero":
        return lambda t: before
    return lambda t: before + (t / PERIOD_S - k) * (after - before)


def breakpoints(samples: FloatArray, delay: float = 0.0) -> FloatArray:
    """Sample instants, and those at which the delayed drive has its own."""
    grid = PERIOD_S * np.arange(len(samples))
    late = grid + delay
    return np.unique(np.concatenate((grid, late[(late > 0.0) & (late < grid[-1])])))


def solved(
    rate: Callable[[float, FloatArray, float], list[float]],
    samples: FloatArray,
    hold: str,
    start: list[float],
    *,
    delay: float = 0.0,
    drive: Callable[[float], Drive] | None = None,
) -> FloatArray:
    """States (samples, n) of y' = rate(t, y, u) at the samples, restarted at every breakpoint of the drive.

    `drive(at)`: the drive on the piece around `at`, instead of what `hold` makes of the samples.
    """
    grid = PERIOD_S * np.arange(len(samples))
    edges = breakpoints(samples, delay)
    y, rows = np.array(start), [np.array(start)]
    for a, b in zip(edges[:-1], edges[1:], strict=True):
        if b - a > 1e-12:
            middle = 0.5 * (a + b)
            u = drive(middle) if drive else shifted(held(samples, hold, middle - delay), delay)
            y = solve_ivp(lambda t, y, u=u: rate(t, y, u(t)), (a, b), y, **OPTIONS).y[:, -1]
        if np.abs(grid - b).min() < 1e-12 and len(rows) < len(grid):
            rows.append(y)
    return np.array(rows)


def shifted(drive: Drive, delay: float) -> Drive:
    """`drive`, `delay` later."""
    return lambda t: drive(t - delay)


Other = Callable[[FloatArray, float], float]
"""All forces but dry friction, of state and drive [mm/s^2]."""
Rates = Callable[[FloatArray], list[float]]
"""Of the states behind displacement and velocity."""


def without_friction(y: FloatArray, u: float) -> float:
    """Of the Duffing oscillator."""
    return duffing(y[0], y[1], u)


def stick_slip(
    samples: FloatArray,
    hold: str,
    level: float,
    other: Other = without_friction,
    rates: Rates = lambda y: [],
    more: tuple[float, ...] = (),
    sliding: Callable[[float], float] | None = None,
) -> FloatArray:
    """(samples, n) of an oscillator with dry friction: sliding until it stops, then held up to `level`.

    `more`: states of its own at the start, which move by `rates`. `sliding`: level by velocity; None: `level`.
    """
    of_speed = sliding or (lambda v: level)
    edges, y = breakpoints(samples), np.array([Z_0, V_0, *more])
    rows = [y]
    for a, b in zip(edges[:-1], edges[1:], strict=True):
        u = held(samples, hold, 0.5 * (a + b))
        t = a
        while t < b:
            force = other(y, u(t))
            direction = math.copysign(1.0, y[1] or force)
            sticks = y[1] == 0.0 and abs(force) <= level * (1.0 + 1e-9) and not _grows(other, y, u, t, level)
            if sticks:
                t, y = _stick(u, t, b, y, level, other, rates)
            else:
                t, y = _slip(u, t, b, y, of_speed, direction, other, rates)
        rows.append(y)
    return np.array(rows)


def _grows(other: Other, y: FloatArray, u: Drive, t: float, level: float) -> bool:
    """Whether a force that has reached the level goes on."""
    force, later = abs(other(y, u(t))), abs(other(y, u(t + 1e-7)))
    return force >= level * (1.0 - 1e-9) and later > force


def _stick(
    u: Drive, t: float, end: float, y: FloatArray, level: float, other: Other, rates: Rates
) -> tuple[float, FloatArray]:
    """Until the other forces exceed the level, or `end`."""

    def starts(at: float, state: FloatArray) -> float:
        return abs(other(state, u(at))) - level

    starts.terminal, starts.direction = True, 1.0  # type: ignore[attr-defined]
    found = solve_ivp(lambda at, s: [0.0, 0.0, *rates(s)], (t, end), y, events=starts, **OPTIONS)
    return float(found.t[-1]), found.y[:, -1]


def _slip(
    u: Drive,
    t: float,
    end: float,
    y: FloatArray,
    sliding: Callable[[float], float],
    direction: float,
    other: Other,
    rates: Rates,
) -> tuple[float, FloatArray]:
    """Until the next stop, or `end`."""

    def stops(at: float, state: FloatArray) -> float:
        return state[1] * direction if at > t else 1.0

    stops.terminal, stops.direction = True, -1.0  # type: ignore[attr-defined]
    found = solve_ivp(
        lambda at, s: [s[1], other(s, u(at)) - sliding(s[1]) * direction, *rates(s)],
        (t, end), y, events=stops, **OPTIONS,
    )  # fmt: skip
    last = found.y[:, -1].copy()
    if found.status == 1:
        last[1] = 0.0
    return float(found.t[-1]), last
