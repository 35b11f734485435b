"""An oscillator's model against a sweep of frequencies, as `rtctl.border.simulation.Simulation`.

A sweep is followed row after row in its own order, each row from the motion at the row before: where a response folds,
rising and falling sweeps leave it at different frequencies, and so does the simulation. The sweep is taken as so slow
that each row has settled. An output holds the in-phase and the quadrature part of each row, one after the other.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from plant_sim.oscillator.equation.binding import bind
from plant_sim.oscillator.equation.terms import TERMS
from plant_sim.oscillator.mechanism import OscillatorMechanism
from plant_sim.oscillator.mechanisms import MECHANISMS
from plant_sim.oscillator.motion import Equation
from plant_sim.oscillator.simulation import OscillatorSimulation
from plant_sim.oscillator.steady.path import Active, PeriodicDrive, drive_of, readings_of
from plant_sim.oscillator.steady.shooting import as_argument, shooting
from rtctl.border.arrays import ComplexArray, FloatArray
from rtctl.border.errors import InputError
from rtctl.border.mechanisms import Mechanism
from rtctl.border.motion import DERIVATIVES
from rtctl.border.simulation import FreeParameter, Prediction, Stimulus
from rtctl.border.work import count_work

FINE_STEPS = 128.0
"""Steps in a period of the fastest motion where none are asked for."""
PHASE_ERROR = 1e-4
"""Largest error of a resonance's frequency by the integration, in half-widths: RK4 is off by (w h)^4 / 120 of it."""
MOST_STEPS = 2**11
SETTLING = 6.0
"""Time constants (2 / damping) that a motion is followed where Newton's method finds no way: e^-6 is left."""
LEAST_SETTLING, MOST_SETTLING = 10, 400
"""Limits of that in periods."""
ATTEMPTS = 8
"""Times that a motion is followed before it is taken as it is."""
GUIDED_ATTEMPTS = 2
"""The same where the measurement says where the motion is: a parameter set without a branch there is far off."""
OTHER_BRANCH = 0.2
"""Distance from the measured amplitude, in parts of it, from which another branch is looked for beside it."""
NEIGHBOUR = 0.02
"""Difference of the amplitudes of two lanes, in parts of one, up to which they have the same branches."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SteadySimulation:
    """The steady state of a model under the sine of each row of a sweep."""

    model: OscillatorSimulation

    @property
    def kind(self) -> str:
        """See `Simulation.kind`."""
        return self.model.kind

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """See `Simulation.parameters`."""
        return self.model.parameters

    @property
    def mechanisms(self) -> tuple[Mechanism, ...]:
        """See `Simulation.mechanisms`."""
        return self.model.mechanisms

    @property
    def outputs(self) -> tuple[str, ...]:
        """See `Simulation.outputs`: the response alone."""
        return (self.model.response,)

    @property
    def state(self) -> tuple[str, ...]:
        """See `Simulation.state`: a steady state has forgotten its start."""
        return ()

    @property
    def catalogue(self) -> tuple[str, ...]:
        """Ids of the mechanisms that a steady state shows."""
        return tuple(name for name, one in MECHANISMS.items() if one.in_steady_state)

    def starting(self, stimulus: Stimulus, values: FloatArray) -> FloatArray:
        """See `Simulation.starting`."""
        return np.zeros(0)

    def predict(
        self,
        stimulus: Stimulus,
        values: FloatArray,
        initial: FloatArray | None = None,
        steps_per_period: float | None = None,
        refine: int = 1,
    ) -> Prediction:
        """See `Simulation.predict`; two samples a row. Raises ValueError where no sensible step resolves the model."""
        values = np.atleast_2d(np.asarray(values, dtype=np.float64))
        found = np.empty((len(values), stimulus.samples))
        for lanes in self.model.sharing_a_drive(values):
            steps = refine * (steps_per_period or FINE_STEPS)
            for row, amplitudes in enumerate(self._rows(stimulus, values[lanes], steps)):
                parts = np.column_stack([amplitudes.real, amplitudes.imag])
                width = min(2, stimulus.samples - 2 * row)
                found[lanes, 2 * row : 2 * row + width] = parts[:, :width]
        finite = np.isfinite(found)
        first = np.where(finite.all(axis=1), -1, np.argmin(finite, axis=1)).astype(np.int64)
        return Prediction({self.model.response: found}, first)

    def forces_along(
        self,
        extended: SteadySimulation,
        stimulus: Stimulus,
        values: FloatArray,
        displacement: FloatArray,
        velocity: FloatArray,
    ) -> FloatArray | None:
        """See `HasForces.forces_along`: along a course in time, as the sine of a row is one."""
        return self.model.forces_along(extended.model, stimulus, values, displacement, velocity)

    def extended(self, mechanisms: tuple[str, ...]) -> SteadySimulation:
        """See `Simulation.extended`."""
        return replace(self, model=self.model.extended(mechanisms))

    def with_values(self, values: FloatArray) -> SteadySimulation:
        """See `Simulation.with_values`."""
        return replace(self, model=self.model.with_values(values))

    def _rows(self, stimulus: Stimulus, values: FloatArray, steps: float) -> Iterator[NDArray[np.complex128]]:
        """Yield the complex amplitudes (lanes,) of each row, for lanes that share a drive."""
        model, frequencies = self.model, stimulus.inputs["frequency"][::2]
        active = [one for one in model.mechanisms if model.acts(one, values)]
        equation = Equation.of(model.parameters, active, values)
        own = [_in_order(model, active, lane) for lane in values]
        derivatives = DERIVATIVES[model.response]
        reach = (
            stimulus.peak.get(model.response, 0.0) / (2.0 * np.pi * float(frequencies.min())) ** derivatives
        )
        fastest, _ = equation.rates(max(reach, equation.rest()), float(stimulus.inputs["drive"].max()))
        free = float(equation.rows[TERMS.index("damping")].min())
        course = _Course(equation, own, derivatives, stimulus.guide.get(model.response))
        states = _rest(equation, len(values))
        for k, frequency_hz in enumerate(frequencies.tolist()):
            settling = _settling_periods(frequency_hz, free)
            count = _steps(steps, fastest / (2.0 * np.pi * frequency_hz), settling)
            drive = drive_of(float(stimulus.inputs["drive"][2 * k]), frequency_hz, count, own[0])
            yield course.row(k, states, drive, settling)


class _Found(NamedTuple):
    """What was found of a row."""

    amplitudes: ComplexArray
    """Complex amplitudes (lanes,)."""
    states: FloatArray
    """States (lanes, states) of the motions at the crest of the drive."""


class _Course(NamedTuple):
    """What stays the same from row to row of a sweep."""

    equation: Equation
    own: Sequence[Active]
    """Mechanisms that act in each lane."""
    derivatives: int
    guide: FloatArray | None
    """Measured response (2 rows,); None: the rows before decide on the branch."""

    def row(self, k: int, states: FloatArray, drive: PeriodicDrive, settling: int) -> ComplexArray:
        """Return the complex amplitudes (lanes,) of row `k`, and move `states` (lanes, states) to its motions."""
        if self.guide is None or 2 * k + 1 >= len(self.guide) or self.equation.is_linear:
            return self._settle(states, drive, settling)
        wanted = complex(self.guide[2 * k], self.guide[2 * k + 1])
        begin = self._beside(states, wanted, drive.frequency_hz)
        found = self._settle(states, drive, settling, guesses=begin)
        far = np.flatnonzero(~(np.abs(found - wanted) <= OTHER_BRANCH * abs(wanted)))
        if len(far):
            self._look_beside(_Found(found, states), wanted, far, drive, settling)
        return found

    def _look_beside(
        self, now: _Found, wanted: complex, far: NDArray[np.int64], drive: PeriodicDrive, settling: int
    ) -> None:
        """Move the lanes `far` from what was measured to a branch that is nearer, where there is one.

        The first one tells for its neighbours, such as the lanes by which a slope is found, whether there is: by
        themselves some of them would take it and others not, and their difference would be no slope.
        """
        begin = self._beside(now.states, wanted, drive.frequency_hz)
        first, others = far[:1], far[1:]
        before = now.amplitudes[far]
        alike = np.abs(before[1:] - before[0]) <= NEIGHBOUR * abs(before[0])
        if self._take_nearer(now, begin, wanted, first, drive, settling):
            begin[others[alike]] = now.states[first]
        else:
            others = others[~alike]
        if len(others):
            self._take_nearer(now, begin, wanted, others, drive, settling)

    # 6 parameters because a branch is looked for with these
    def _take_nearer(  # noqa: PLR0913
        self,
        now: _Found,
        begin: FloatArray,
        wanted: complex,
        lanes: NDArray[np.int64],
        drive: PeriodicDrive,
        settling: int,
    ) -> bool:
        """Settle `lanes` from their states in `begin`, take what is nearer to `wanted`, return whether one was."""
        settled = begin[lanes]
        other = self._settle(settled, drive, settling, lanes)
        distance = np.nan_to_num(np.abs(now.amplitudes[lanes] - wanted), nan=np.inf)
        nearer = np.abs(other - wanted) < distance
        now.amplitudes[lanes[nearer]], now.states[lanes[nearer]] = other[nearer], settled[nearer]
        return bool(nearer.any())

    def _beside(self, states: FloatArray, wanted: complex, frequency_hz: float) -> FloatArray:
        """Return states (lanes, states) with the displacement and velocity of a response's complex amplitude."""
        amplitude = wanted / (2j * np.pi * frequency_hz) ** self.derivatives
        begin = np.nan_to_num(states)
        begin[:, 0] = amplitude.real
        begin[:, 1] = -2.0 * np.pi * frequency_hz * amplitude.imag
        return begin

    def _settle(
        self, states: FloatArray, drive: PeriodicDrive, settling: int,
        which: NDArray[np.int64] | None = None, guesses: FloatArray | None = None,
    ) -> ComplexArray:  # fmt: skip
        """Move `states` (lanes, states) of `which` lanes, None: all, to their orbits; return their amplitudes."""
        steps, lanes = len(drive.course) // 2, len(states)
        displacement = np.empty((steps, lanes))
        march = _of_motion_alone(self.equation.prepared(drive.step_s))
        attempts = ATTEMPTS if self.guide is None else GUIDED_ATTEMPTS
        guesses = np.full_like(states, np.nan) if guesses is None else guesses
        rows, own = self.equation.rows, self.own
        if which is not None:
            rows, own = np.ascontiguousarray(rows[:, which]), [own[lane] for lane in which]
        periods = shooting()(
            march, states, guesses, rows, drive.nodes, drive.step_s, settling, attempts, displacement
        )
        count_work(periods * steps * self.equation.step_cost)
        return readings_of(displacement, drive, self.derivatives, own)


integrator: Any = None  # replaced by `bind`


# 9 parameters because they are the integrator's
def motion_alone(  # noqa: PLR0913
    z: Any, v: Any, w: Any, nodes: Any, h: float, substeps: int, p: Any, out_z: Any, out_v: Any
) -> None:
    """Integrate without accelerations: a kernel that is an argument of another one has all of its parameters."""
    integrator(z, v, w, nodes, h, substeps, p, out_z, out_v)


@lru_cache(maxsize=256)
def _of_motion_alone(whole: Any) -> Any:
    """Return an integrator without the parameters for accelerations."""
    return as_argument(bind(motion_alone, integrator=whole))


def _rest(equation: Equation, lanes: int) -> FloatArray:
    """Return the state (lanes, states) of motions at rest."""
    nothing = np.zeros(lanes)
    return np.vstack([nothing, nothing, equation.own_start(nothing, nothing)]).T.copy()


def _in_order(model: OscillatorSimulation, active: list[OscillatorMechanism], lane: FloatArray) -> Active:
    return [(one, model.values_of(one, lane)) for one in sorted(active, key=lambda one: one.stage)]


def _settling_periods(frequency_hz: float, damping: float) -> int:
    """Return the periods of the drive in which a motion settles."""
    periods = SETTLING * 2.0 * frequency_hz / damping if damping > 0.0 else math.inf
    return int(min(max(periods, LEAST_SETTLING), MOST_SETTLING))


def _steps(steps_per_period: float, fastest: float, settling: int) -> int:
    """Return the integrator's steps in a period of the drive, even.

    Args:
        steps_per_period: Steps in a period of the fastest motion that are asked for.
        fastest: Frequency of that motion over the drive's.
        settling: Periods in which a motion settles.

    Raises:
        ValueError: No sensible step resolves the model.
    """
    by_phase = 2.0 * np.pi * (settling / (120.0 * PHASE_ERROR)) ** 0.25
    wanted = max(steps_per_period, by_phase) * max(fastest, 1.0)
    if not wanted <= MOST_STEPS:
        raise ValueError(
            f"the model's fastest motion is {fastest:.3g} times as fast as the drive: no sensible number of steps "
            "follows it"
        )
    count: int = 2 * math.ceil(0.5 * wanted)
    return count


def steady_simulation(simulation: OscillatorSimulation, source: str) -> SteadySimulation:
    """Return the steady state of a model. Raises InputError where a mechanism of it does not act in one."""
    refused = [one.id for one in simulation.mechanisms if not one.in_steady_state]
    if refused:
        raise InputError(
            f"{source}: {', '.join(refused)}: a steady state does not show it, so no sweep tells its size; take it out "
            "of the model, or use records in time"
        )
    return SteadySimulation(model=simulation)
