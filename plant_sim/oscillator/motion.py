"""The equation of motion of several lanes: which terms and memories it has, its table of rows, its integration."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from plant_sim.oscillator.equation.binding import bind
from plant_sim.oscillator.equation.memory import combined, combined_dampers
from plant_sim.oscillator.equation.terms import (
    CUBIC,
    DAMPING,
    DAMPING_2,
    DAMPING_ABS,
    DRIFT,
    FRICTION,
    FRICTION_EXCESS,
    NOMINAL,
    PARAMETRIC,
    QUADRATIC,
    QUINTIC,
    RUBBING,
    STIFFNESS,
    TERMS,
    law_for,
)
from plant_sim.oscillator.integration.friction import COULOMB, STRIBECK
from plant_sim.oscillator.integration.rk4 import bind_rk4
from plant_sim.oscillator.integration.splitting import KICKS, acceleration, kick_for, propagator, splitting
from plant_sim.oscillator.integration.steps import Plan, plan
from plant_sim.oscillator.mechanism import Driven, Memory, OscillatorMechanism
from plant_sim.oscillator.nominal import ROWS
from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import FreeParameter

STATES_OF_A_HUNDREDFOLD_COST = 25.0
"""States of mechanisms with which an integration step takes about a hundred times as long as without any (measured, 8
lanes: 28 ns without, 25 ns with 1 state, 48 ns with 5, 2.4 us with 24, which no longer fit in registers)."""
TRANSITION = 0.01
"""Share of the acceleration over a force's transition speed that the rate of a motion counts: at 256 steps in a period
of it the velocity changes by 2.5 transition speeds a step at most. Measured with a smooth sign of 1 to 30 % of the top
speed: off by 1e-7 of the motion, by 1e-5 at the 64 steps of fits."""
WEAK = 1e-4
"""Force over the acceleration up to which no step is shorter for its transition. Steps that do not resolve it are off
by 3e-3 of that ratio, by 1e-2 at the 64 steps of fits (measured, 1e-5 to 0.1 and a sign smooth over 0.1 to 10 %)."""
BLOCK_SAMPLES = 256
"""Samples of all lanes that are transposed at once: 64 kB of 32 lanes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Equation:
    """An equation of motion; `rows` (rows, lanes) hold the terms, then the constants of each memory."""

    rows: FloatArray
    terms: frozenset[str]
    memories: tuple[Memory, ...]
    constants: tuple[int, ...] = ()
    """Number of rows of each memory."""
    own_rate: Callable[[float], float] = lambda speed: 0.0
    """Rate [1/s] that mechanisms add at speeds up to the given one."""
    transitions: tuple[tuple[float, float], ...] = ()
    """Changes of the velocity within which forces change as the motion turns, and these forces, of all lanes."""

    @classmethod
    def of(
        cls, parameters: Sequence[FreeParameter], active: Sequence[OscillatorMechanism], values: FloatArray
    ) -> Equation:
        """Build an equation from values (lanes, parameters) and the mechanisms that are active in them."""
        column = {parameter.name: k for k, parameter in enumerate(parameters)}
        table = np.zeros((len(TERMS), len(values)))
        for name, row in ROWS.items():
            table[TERMS.index(row)] = values[:, column[name]]
        terms = set(NOMINAL)
        own = [
            (
                one,
                [
                    {p.name: float(lane[column[f"{one.id}.{p.name}"]]) for p in one.parameters}
                    for lane in values
                ],
            )
            for one in sorted(active, key=lambda one: one.id)  # one kernel, whichever was added first
        ]
        for one, of_all in own:
            for row, made in one.terms.items():
                table[TERMS.index(row)] += [
                    lane[made] if isinstance(made, str) else made(lane) for lane in of_all
                ]
                terms.add(row)
        remembering = [
            (one, one.memory.at(of_all), of_all)
            for one, of_all in own
            if one.memory is not None and any(one.memory.acts(lane) for lane in of_all)
        ]
        constants = [
            np.array([memory.constants(lane) for lane in of_all]).T for _, memory, of_all in remembering
        ]
        return cls(
            rows=np.ascontiguousarray(np.vstack([table, *constants])),
            terms=frozenset(terms),
            memories=tuple(memory for _, memory, _ in remembering),
            constants=tuple(len(rows) for rows in constants),
            own_rate=lambda speed: max(
                math.hypot(*(one.fastest_rate(of_all[j], speed) for one, of_all in own))
                for j in range(len(values))
            ),
            transitions=tuple(
                change
                for one, of_all in own
                for lane in of_all
                if (change := one.transition(lane)) is not None
            ),
        )

    def rest(self) -> float:
        """Return the distance of the farthest equilibrium without drive: 0, or that of the wells."""
        stiffness, cubic = self.rows[STIFFNESS], self.rows[CUBIC]
        bistable = (stiffness < 0.0) & (cubic > 0.0)
        return float(np.sqrt(-stiffness[bistable] / cubic[bistable]).max(initial=0.0))

    def rates(
        self, reach: float, drive: float = 0.0, duration_s: float = 0.0, swing: float = math.inf
    ) -> tuple[float, float]:
        """Return the fastest angular frequency and damping [1/s].

        Args:
            reach: largest displacement of the motions.
            drive: largest drive.
            duration_s: time over which the stiffness drifts [s].
            swing: half of the motions' range, if it is less than `reach`.
        """
        p, reach2 = np.abs(self.rows), reach * reach
        stiffness = p[STIFFNESS] + 2.0 * p[QUADRATIC] * reach + 3.0 * p[CUBIC] * reach2
        stiffness += 5.0 * p[QUINTIC] * reach2 * reach2 + p[PARAMETRIC] * drive + p[DRIFT] * duration_s
        rate = float(np.sqrt(stiffness.max()))
        speed = rate * min(reach, swing)
        damping = p[DAMPING] + p[DAMPING_2] * reach2 + p[DAMPING_ABS] * speed
        return math.hypot(rate, self.own_rate(speed), self._turning(rate, speed)), float(damping.max())

    def _turning(self, rate: float, speed: float) -> float:
        """Return the angular frequency [1/s] by which steps resolve forces that change as the motion turns."""
        acceleration = rate * speed
        if not acceleration > 0.0:
            return 0.0
        return max(
            (
                min(TRANSITION * acceleration / within, rate * force / (WEAK * acceleration))
                for within, force in self.transitions
            ),
            default=0.0,
        )

    def share(self, reach: float) -> float:
        """Return the share of the nonlinear force in the linear one at `reach`; infinite if it cannot be split."""
        if self.memories or not self.terms <= KICKS or not (self.rows[STIFFNESS] > 0.0).all():
            return 0.0 if self.is_linear else math.inf
        p, reach2 = np.abs(self.rows), reach * reach
        nonlinear = p[QUADRATIC] * reach + (p[CUBIC] + p[QUINTIC] * reach2) * reach2
        return float((nonlinear / p[STIFFNESS]).max())

    @property
    def is_linear(self) -> bool:
        """Whether there are no forces but linear ones, of any sign."""
        linear = {"gain", "damping", "stiffness"}
        others = [TERMS.index(term) for term in self.terms - linear]
        return not self.memories and not self.rows[others].any()

    def plan(
        self,
        period_s: float,
        reach: float,
        hold: str = "",
        steps_per_period: float | None = None,
        *,
        drive: float = 0.0,
        duration_s: float = 0.0,
        swing: float = math.inf,
    ) -> Plan:
        """Return how to integrate motions between samples.

        Args:
            period_s: sample period [s].
            reach: largest displacement of the motions.
            hold: the drive's hold between its samples; "": mechanisms change it so that RK4's short steps are needed.
            steps_per_period: RK4 steps in a period of the fastest pole; None: chosen.
            drive: largest drive.
            duration_s: time over which the stiffness drifts [s].
            swing: half of the motions' range, if it is less than `reach`.

        Raises:
            ValueError: no sensible step resolves the model.
        """
        share = self.share(reach) if hold else math.inf
        rate, damping = self.rates(reach, drive, duration_s, swing)
        return plan(
            period_s,
            rate,
            damping,
            share,
            parabolic=hold != "band-limited",
            steps_per_period=steps_per_period,
        )

    def integrate(
        self, drive: Driven, how: Plan, start: FloatArray, acting: FloatArray | None = None
    ) -> list[FloatArray]:
        """Return displacement and velocity (lanes, samples) from `start` (lanes, 2).

        With the drive `acting` (samples,) at the samples, of two values where it jumps there, the acceleration too.
        """
        lanes, samples = self.rows.shape[1], len(drive.nodes) // how.substeps + 1
        z, v = start[:, 0].copy(), start[:, 1].copy()
        courses = [np.empty((samples, lanes)) for _ in range(2 if acting is None else 3)]
        if how.splitting:
            present = {term for term in self.terms if self.rows[TERMS.index(term)].any()}
            split = _splitting(kick_for(present))
            split(z, v, drive.nodes, how.substeps, propagator(self.rows, drive.step_s), *courses[:2])
            if acting is not None:
                courses[2] = acceleration(self.rows, courses[0], courses[1], acting)
        else:
            self.march(z, v, drive, how.substeps, courses, acting=acting)
        return [_by_lane(course) for course in courses]

    @property
    def rubs(self) -> bool:
        """Whether there is dry friction."""
        return bool(self.rows[[FRICTION, FRICTION_EXCESS]].any())

    @property
    def step_cost(self) -> float:
        """Work of one integration step, in steps without states of their own."""
        return 1.0 + 100.0 * (self.states / STATES_OF_A_HUNDREDFOLD_COST) ** 3

    @property
    def states(self) -> int:
        """Number of states of all memories."""
        return sum(memory.states for memory in self.memories)

    def own_start(self, z: FloatArray, v: FloatArray) -> FloatArray:
        """Return the states (states, lanes) of all memories where motions start.

        The start is displacement z and velocity v (lanes,).
        """
        states = [
            np.zeros((memory.states, len(z)))
            if memory.start is None
            else np.array([memory.start(*pair) for pair in zip(z.tolist(), v.tolist(), strict=True)]).T
            for memory in self.memories
        ]
        return np.ascontiguousarray(np.vstack(states)) if states else np.zeros((0, len(z)))

    def prepared(self, step_s: float) -> Any:
        """Return the compiled integrator of the equation, whose rows are made ready for steps of `step_s` [s]."""
        layout = [
            (memory.law, memory.states, constants, memory.damping)
            for memory, constants in zip(self.memories, self.constants, strict=True)
        ]
        row = len(TERMS)
        for memory, count in zip(self.memories, self.constants, strict=True):
            if memory.step is not None:
                self.rows[row + memory.step] = step_s
            row += count
        fades = bool(self.rows[FRICTION_EXCESS].any())
        return _integrator(self.terms, tuple(layout), self.rubs, fades)

    def march(
        self,
        z: FloatArray,
        v: FloatArray,
        drive: Driven,
        substeps: int,
        out: Sequence[FloatArray],
        own: FloatArray | None = None,
        acting: FloatArray | None = None,
    ) -> None:
        """Integrate by RK4; z, v and the states are left at the end of the drive.

        Args:
            z: displacement (lanes,) at the start.
            v: velocity (lanes,) at the start.
            drive: the drive at the integrator's instants.
            substeps: steps between two samples.
            out: displacement, velocity, and acceleration if it is wanted (samples, lanes), out.
            own: the memories' states (states, lanes); None: `own_start`.
            acting: drive (samples,) at the samples by which the acceleration is, if that is wanted.
        """
        integrator = self.prepared(drive.step_s)
        states = self.own_start(z, v) if own is None else own
        of_acceleration = () if acting is None else (np.ascontiguousarray(acting), out[2])
        integrator(z, v, states, drive.nodes, drive.step_s, substeps, self.rows, *out[:2], *of_acceleration)


def _by_lane(course: FloatArray) -> FloatArray:
    """Return `course` (samples, lanes) transposed, by blocks that stay in the processor's cache."""
    out = np.empty(course.shape[::-1])
    for first in range(0, len(course), BLOCK_SAMPLES):
        rows = slice(first, first + BLOCK_SAMPLES)
        out[:, rows] = course[rows].T
    return out


@lru_cache(maxsize=256)
def _integrator(
    terms: frozenset[str], memories: tuple[tuple[Any, int, int, Any], ...], friction: bool, fades: bool
) -> Any:
    """Return the compiled integrator of an equation with these parts; `fades`: its dry friction does."""
    memoryless = law_for(terms - RUBBING, memory=bool(memories))
    rubbing = STRIBECK if fades else COULOMB if friction else {}
    if not memories:
        return bind_rk4(memoryless, 0, **rubbing)
    row, laws, dampers = len(TERMS), [], []
    for law, states, constants, damping in memories:
        laws.append((law, row, states))
        if damping is not None:
            dampers.append((damping, row))
        row += constants
    states = sum(count for _, _, count in laws)
    impulse, damping = (combined_dampers(dampers, part) for part in (0, 1))
    return bind_rk4(combined(memoryless, laws), states, impulse, damping, **rubbing)


@lru_cache
def _splitting(kick: Any) -> Any:
    """Return the compiled splitting with this nonlinear force."""
    return bind(splitting, kick=kick)
