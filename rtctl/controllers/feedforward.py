"""Feedforward through the inverse of the identified model: the current that brings the deflection to the next setpoint.

    D(v*; history) = setpoint one period ahead,   i^2 = (v*^2 - a s) / (1 - a),   a = exp(-h / tau)

The model runs on its own commands: s [mA^2] is its temperature, the stack its history; what it gets wrong is the PI's.
Deflection is not monotone in v: after a reversal expansion moves it the wrong way until domains switch. So v* is the
first crossing found by walking outwards from the present v on a grid, then between two grid points. In a reversal the
walk jumps across the hysteresis at once, where an integrator needs tens of milliseconds.
State order: s, then the stack of D.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rtctl.arithmetic.elementary import exp
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.hysteresis.film_memory import FilmMemory
from rtctl.hysteresis.packing import array_at, number_at, pack, preisach_at
from rtctl.hysteresis.preisach.model import PreisachParams, output_at, preisach_step
from rtctl.models.span import Span
from rtctl.models.vo2 import Vo2Model

WALK_POINTS = 96
STILL = 2e-4  # of the deflection range: a smaller change of setpoint moves nothing


class InverseParams(NamedTuple):
    """Parameters of the kernel besides the deflection model; currents in mA, `still` in um."""

    time_constant_s: float
    low: float
    high: float
    still: float


DEFLECTION_PART = 1 + len(InverseParams._fields)


@kernel
def walk_to(
    stack: FloatArray, target: float, v: float, p: InverseParams, deflection: PreisachParams
) -> float:
    """Return v* [mA] nearest to v where the deflection crosses `target` [um], or the best one in the range."""
    now = output_at(stack, int(stack[0]), deflection)
    if abs(target - now) <= p.still:
        return v
    rising = target > now
    end = p.high if rising else p.low
    trial = stack.copy()
    step = (end - v) / WALK_POINTS
    best, best_miss, before = v, abs(target - now), now
    for k in range(1, WALK_POINTS + 1):
        there = v + k * step
        y = preisach_step(trial, there, deflection).y
        if (y >= target) == rising:
            return there - step * (y - target) / (y - before) if y != before else there
        if abs(target - y) < best_miss:
            best, best_miss = there, abs(target - y)
        before = y
    return best


@kernel
def inverse_step(
    state: FloatArray, target: float, elapsed_s: float, p: InverseParams, deflection: PreisachParams
) -> float:
    """Return the current [mA] for the next period; advance `state` by it, in place."""
    stack = state[1:]
    a = exp(-elapsed_s / p.time_constant_s)
    s = state[0]
    wanted = walk_to(stack, target, math.sqrt(max(s, 0.0)), p, deflection)
    power = (wanted * wanted - a * s) / (1.0 - a)
    current = min(max(math.sqrt(max(power, 0.0)), p.low), p.high)
    state[0] = current * current + (s - current * current) * a
    preisach_step(stack, math.sqrt(max(state[0], 0.0)), deflection)
    return current


@kernel
def packed_inverse_step(memory: FloatArray, target: float, elapsed_s: float) -> float:
    """Take `inverse_step` in a packed memory: state, parameters, those of the deflection model."""
    p = InverseParams(number_at(memory, 1), number_at(memory, 2), number_at(memory, 3), number_at(memory, 4))
    return inverse_step(array_at(memory, 0), target, elapsed_s, p, preisach_at(memory, DEFLECTION_PART))


class InverseFeedforward:
    """The feedforward through the inverse of an identified model."""

    preview_s = 0.0

    def __init__(self, model: Vo2Model, current: Span) -> None:
        self._model = model.deflection_preisach
        still = STILL * model.deflection.width
        self.params = InverseParams(model.time_constant_s, current.low, current.high, still)
        self._memory = self._packed(current.low)

    def start(self, level: float) -> float:
        """Start at rest at the applied level, from a full cooling; see `Feedforward`."""
        self._memory = self._packed(level)
        return level

    def inherit(self, memory: FilmMemory) -> None:
        """Take over what the film has been through; see `rtctl.hysteresis.film_memory`."""
        state = array_at(self._memory, 0)
        state[0], state[1:] = memory.power, memory.beam

    def _packed(self, level: float) -> FloatArray:
        state = np.concatenate(([level * level], self._model.initial_state(level)))
        return pack(state, self.params, self._model.params)

    @property
    def memory(self) -> FloatArray:
        """The memory that `packed_inverse_step` advances, until the next start."""
        return self._memory

    def step(self, upcoming: float, elapsed_s: float) -> float:
        """Return the command [mA] for the next period."""
        return packed_inverse_step(self._memory, upcoming, elapsed_s)
