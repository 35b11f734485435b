"""Effects that are hidden in a system, written for themselves; each has one size, found so that it shows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from rtctl.border.arrays import FloatArray

from .system import HiddenSystem


@dataclass(kw_only=True)
class Acting:
    """What an effect of one size does to a system; what it leaves alone is as the system is."""

    delay_s: float = 0.0
    late_s: float = 0.0
    hold: str = "zero"
    shape_input: Callable[[FloatArray, FloatArray], FloatArray] = lambda t, u: u
    """From times (n, 1) and levels (n, records)."""
    input_lag_s: float = 0.0
    output_lag_s: float = 0.0
    corner: float = 0.0
    """Corner [1/s] of a high-pass of the output."""
    read: Callable[[FloatArray, FloatArray], FloatArray] = lambda t, y: y
    push: Callable[[float, FloatArray, FloatArray], FloatArray | float] = lambda t, x, u: 0.0
    """Added to the rate of `state`."""
    state: int = 0
    slow: tuple[float, float] | None = None
    """Rate and time constant [s] of a slow part of `state`."""
    factor: dict[str, Callable[[float, FloatArray, FloatArray], FloatArray | float]] = field(
        default_factory=dict
    )
    """By which parameters are multiplied."""


@dataclass(frozen=True, kw_only=True)
class Scene:
    """Sizes of the plain motion, by which effects are scaled."""

    duration_s: float
    slowness_s: float
    """Time in which the output changes by its size."""
    sizes: tuple[float, ...]
    """RMS of the states from their references."""
    rates: tuple[float, ...]
    highs: tuple[float, ...]
    """0.9 quantiles of the states."""
    input: tuple[float, float]
    """RMS and standard deviation."""
    output: tuple[float, float]
    """RMS from `zero` and standard deviation."""
    zero: float
    """Value from which the output is counted."""
    period_s: float


Make = Callable[[float, Scene, HiddenSystem], Acting]


def _play(u: FloatArray, width: float) -> FloatArray:
    made, w = np.empty_like(u), np.clip(0.0, u[0] - width, u[0] + width)
    for k in range(len(u)):
        w = np.clip(w, u[k] - width, u[k] + width)
        made[k] = w
    return made


def _drift(name: str) -> Make:
    return lambda a, s, h: Acting(factor={name: lambda t, x, u: 1.0 + a * t / s.duration_s})


def _dependence(name: str, state: int) -> Make:
    return lambda a, s, h: Acting(
        factor={name: lambda t, x, u: 1.0 + a * (x[state] - h.references[state]) / s.sizes[state]}
    )


def _state(k: int, law: Callable[[FloatArray, float], FloatArray]) -> Make:
    """A law of x over its size, times the state's rate."""
    return lambda a, s, h: Acting(
        state=k, push=lambda t, x, u: -a * s.rates[k] * law((x[k] - h.references[k]) / s.sizes[k], 1.0)
    )


def _limit(k: int) -> Make:
    """A hard limit that goes down from the top of the motion with its size."""

    def make(a: float, s: Scene, h: HiddenSystem) -> Acting:
        level = s.highs[k] - a * (s.highs[k] - h.references[k])
        return Acting(
            state=k, push=lambda t, x, u: -30.0 * s.rates[k] / s.sizes[k] * np.maximum(x[k] - level, 0.0)
        )

    return make


def _slow(k: int) -> Make:
    return lambda a, s, h: Acting(state=k, slow=(a * s.rates[k] / s.sizes[k], 8.0 * s.slowness_s))


def effects(system: HiddenSystem) -> Mapping[str, Make]:
    """Effects of a system by the id under which they should be named."""
    u, y = system.input[0], system.reading[0]
    first = next(iter(system.parameters))
    found: dict[str, Make] = {
        f"input.{u}.delay": lambda a, s, h: Acting(delay_s=a * s.slowness_s),
        f"input.{u}.lag": lambda a, s, h: Acting(input_lag_s=a * s.slowness_s),
        f"input.{u}.offset": lambda a, s, h: Acting(shape_input=lambda t, v: v + a * s.input[1]),
        f"input.{u}.gain_drift": lambda a, s, h: Acting(
            shape_input=lambda t, v: v * (1.0 + a * t / s.duration_s)
        ),
        f"input.{u}.saturation": lambda a, s, h: Acting(
            shape_input=lambda t, v: np.tanh(a * v / s.input[0]) * s.input[0] / a
        ),
        f"input.{u}.dead_band": lambda a, s, h: Acting(
            shape_input=lambda t, v: v - np.clip(v, -a * s.input[0], a * s.input[0])
        ),
        f"input.{u}.backlash": lambda a, s, h: Acting(shape_input=lambda t, v: _play(v, a * s.input[1])),
        f"output.{y}.offset": lambda a, s, h: Acting(read=lambda t, v: v + a * s.output[1]),
        f"output.{y}.lag": lambda a, s, h: Acting(output_lag_s=a * s.slowness_s),
        f"output.{y}.highpass": lambda a, s, h: Acting(corner=a / s.slowness_s),
        f"output.{y}.saturation": lambda a, s, h: Acting(
            read=lambda t, v: s.zero + np.tanh(a * (v - s.zero) / s.output[0]) * s.output[0] / a
        ),
        f"output.{y}.hum": lambda a, s, h: Acting(
            read=lambda t, v: v + a * s.output[1] * np.sin(2.0 * np.pi * 0.137 / s.period_s * t + 1.0)
        ),
        f"output.{y}.drift": lambda a, s, h: Acting(read=lambda t, v: v + a * s.output[1] * t / s.duration_s),
        f"output.{y}.skew": lambda a, s, h: Acting(late_s=a * s.slowness_s),
        f"parameter.{first}.drift": _drift(first),
        f"parameter.{first}.dependence": _dependence(first, 1),
    }
    for k, name in enumerate(system.states):
        found |= {
            f"state.{name}.friction": _state(k, lambda x, one: np.tanh(x / 0.02)),
            f"state.{name}.quadratic": _state(k, lambda x, one: x * np.abs(x)),
            f"state.{name}.cubic": _state(k, lambda x, one: x**3),
            f"state.{name}.leak": _state(k, lambda x, one: x),
            f"state.{name}.input": _state(k, lambda x, one: np.ones_like(x)),
            f"state.{name}.limit": _limit(k),
            f"state.{name}.slow": _slow(k),
        }
    return {name: make for name, make in found.items() if name not in system.follows}
