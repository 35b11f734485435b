"""A model file bound to a dataset's units, as `rtctl.border.simulation.Simulation`: drive -> equation -> reading."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from plant_sim.oscillator.equation.terms import GAIN, TERMS
from plant_sim.oscillator.forces_of_mechanisms.along_motions import STEPS, mean_forces, mean_of_steps
from plant_sim.oscillator.forces_of_mechanisms.departures import Departure, acts_as_a_force
from plant_sim.oscillator.integration.node_cache import cached
from plant_sim.oscillator.integration.steps import Plan, check_work
from plant_sim.oscillator.kinks import LEAST, kinks_of
from plant_sim.oscillator.mechanism import Driven, Moved, OscillatorMechanism, Sampled, Values, in_units
from plant_sim.oscillator.mechanisms import MECHANISMS
from plant_sim.oscillator.motion import Equation
from plant_sim.oscillator.nonparametric import UNNAMED
from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.simulation import FreeParameter, Prediction, Stimulus, with_parameter_values
from rtctl.border.work import count_work

STEPS_OF_A_READING = 1.0
"""Steps of an integrator that take as long as a sample's drive and reading do."""
ABSURD = 1e100
"""Displacement that only a model without bound reaches, in any unit."""
MOST_REFINEMENTS = 4
INSTANTS = 24.0
"""In a period of the fastest motion, of which a sensor is told that looks between samples: a cubic from one to the next
is off by (2 pi / 24)^4 / 384, 98 dB down."""


class _Motion(NamedTuple):
    """A motion of several lanes, and how it was integrated."""

    courses: list[FloatArray]
    """Displacement, velocity, and acceleration if that is an output: (lanes, n) at all instants that a sensor sees."""
    drive: Driven
    every: Plan
    """Steps from one of these instants to the next."""
    instants: int
    """Instants in a sample period."""
    acting: FloatArray | None
    """Drive (n,) at all instants by which the acceleration is; None: that is no output."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OscillatorSimulation:
    """The simulation of an oscillator: nominal parameters first, then each mechanism's, in their order in the file."""

    parameters: tuple[FreeParameter, ...]
    mechanisms: tuple[OscillatorMechanism, ...]
    units: Mapping[str, str]
    """Units of "drive", "displacement", "velocity", and of "acceleration" if that is an output."""
    kind: str = "oscillator"
    outputs: tuple[str, ...] = ("displacement", "velocity")
    response: str = "displacement"
    """Output that the sensor reads: the lowest derivative of the motion that was measured."""
    state: tuple[str, ...] = ("displacement", "velocity")

    def starting(self, stimulus: Stimulus, values: FloatArray) -> FloatArray:
        """See `Simulation.starting`."""
        displacement, velocity = (stimulus.initial.get(name, 0.0) for name in self.state)
        read = "displacement" in stimulus.read
        return np.array([self._unread(displacement, values) if read else displacement, velocity])

    def predict(
        self,
        stimulus: Stimulus,
        values: FloatArray,
        initial: FloatArray | None = None,
        steps_per_period: float | None = None,
        refine: int = 1,
    ) -> Prediction:
        """See `Simulation.predict`. Raises ValueError where no sensible step resolves the model."""
        values = np.atleast_2d(np.asarray(values, dtype=np.float64))
        if initial is None:
            start = np.stack([self.starting(stimulus, own) for own in values])
        else:
            start = np.broadcast_to(np.asarray(initial, dtype=np.float64), (len(values), 2)).copy()
        groups = self.sharing_a_drive(values)
        if len(groups) == 1:
            outputs = self._march(stimulus, values, start, steps_per_period, refine)
        else:
            shape = (len(values), stimulus.samples)
            outputs = {name: np.empty(shape) for name in self.outputs}
            for lanes in groups:
                marched = self._march(stimulus, values[lanes], start[lanes], steps_per_period, refine)
                for name, of_lanes in marched.items():
                    outputs[name][lanes] = of_lanes
        return Prediction(outputs, _diverged(outputs["displacement"]))

    def predict_departures(
        self,
        extended: OscillatorSimulation,
        stimulus: Stimulus,
        values: FloatArray,
        initial: FloatArray,
        steps_per_period: float | None = None,
    ) -> Prediction:
        """See `HasDepartures.predict_departures`. Raises ValueError where no sensible step resolves the model."""
        added, own = extended.mechanisms[-1], values[:1, : len(self.parameters)]
        active = [one for one in self.mechanisms if self.acts(one, own)]
        equation = Equation.of(self.parameters, active, own)
        whole, nominal, alone = (
            Equation.of(extended.parameters, acting, values) for acting in ([*active, added], [], [added])
        )
        start = np.tile(initial, (len(values), 1))
        if not acts_as_a_force(added, equation, alone):
            return extended.predict(stimulus, values, start, steps_per_period)
        acting = [*active, added]
        motion = self._move(equation, acting, stimulus, own, start[:1], steps_per_period, planned=whole)
        departure = Departure(equation, motion.drive, start[:1], nominal, alone)
        steps = motion.every.substeps * motion.instants * equation.step_cost
        count_work(len(values) * stimulus.samples * (STEPS_OF_A_READING + steps))
        outputs = {name: np.empty((len(values), stimulus.samples)) for name in self.outputs}
        for lane in range(len(values)):
            courses = equation.integrate(departure.pushed(lane), motion.every, start[:1], motion.acting)
            moved = extended._at_samples(
                motion._replace(courses=courses), stimulus, acting, values[lane : lane + 1]
            )
            for name, of_lane in moved.items():
                outputs[name][lane] = of_lane[0]
        return Prediction(outputs, _diverged(outputs["displacement"]))

    def forces_along(
        self,
        extended: OscillatorSimulation,
        stimulus: Stimulus,
        values: FloatArray,
        displacement: FloatArray,
        velocity: FloatArray,
    ) -> FloatArray | None:
        """See `HasForces.forces_along`."""
        added = extended.mechanisms[-1]
        nominal, own = (Equation.of(extended.parameters, acting, values) for acting in ([], [added]))
        if any(memory.damping is not None for memory in own.memories):
            return None
        steps = STEPS * (stimulus.samples - 1)

        def driven(
            model: OscillatorSimulation, acting: list[OscillatorMechanism], lane: FloatArray
        ) -> Driven:
            drive = model._drive(stimulus, acting, lane, STEPS)
            return drive._replace(nodes=drive.nodes[:steps])

        drive = driven(self, [], values[0])
        if not added.acts_before_the_equation:
            acts = bool(own.memories) or (own.rows[: len(TERMS)] != nominal.rows).any()
            return mean_forces(own, nominal, drive, displacement, velocity) if acts else None
        plain = mean_of_steps(drive.nodes)
        moved = [driven(extended, [added], lane).nodes for lane in values]
        changes = np.array([mean_of_steps(nodes) - plain for nodes in moved])
        forces: FloatArray = nominal.rows[GAIN][:, None] * changes
        return forces

    def with_values(self, values: FloatArray) -> OscillatorSimulation:
        """Return the same model with `values` (parameters,) as its own."""
        return replace(self, parameters=with_parameter_values(self.parameters, values))

    def extended(self, mechanisms: tuple[str, ...]) -> OscillatorSimulation:
        """Return the same with these mechanisms at neutral; shapes at their defaults, or 1 of their unit."""
        added = [in_units((MECHANISMS | UNNAMED)[name], self.units) for name in mechanisms]
        more = [
            FreeParameter(
                name=f"{mechanism.id}.{declared.name}",
                unit=declared.unit_in(
                    z=self.units["displacement"], u=self.units["drive"], y=self.units[self.response]
                ),
                value=_neutral(declared.neutral, declared.default),
                low=declared.searched_low, high=declared.high, fixed=False, declared=declared,
                mechanism=mechanism.id,
            )
            for mechanism in added for declared in mechanism.parameters
        ]  # fmt: skip
        return replace(self, parameters=(*self.parameters, *more), mechanisms=(*self.mechanisms, *added))

    def sharing_a_drive(self, values: FloatArray) -> list[NDArray[np.intp]]:
        """Return groups of lanes whose drive is the same before it reaches the equation."""
        acting = {mechanism.id for mechanism in self.mechanisms if mechanism.acts_before_the_equation}
        columns = [k for k, parameter in enumerate(self.parameters) if parameter.mechanism in acting]
        if not columns or len(values) == 1:
            return [np.arange(len(values))]
        group = np.unique(values[:, columns], axis=0, return_inverse=True)[1].reshape(-1)
        return [np.flatnonzero(group == k) for k in range(group.max() + 1)]

    def _march(
        self,
        stimulus: Stimulus,
        values: FloatArray,
        start: FloatArray,
        steps_per_period: float | None,
        refine: int,
    ) -> dict[str, FloatArray]:
        """Return the outputs (lanes, samples) of lanes that share a drive, by name."""
        active = [mechanism for mechanism in self.mechanisms if self.acts(mechanism, values)]
        equation = Equation.of(self.parameters, active, values)
        motion = self._move(equation, active, stimulus, values, start, steps_per_period, refine)
        return self._at_samples(motion, stimulus, active, values)

    # 8 parameters because the steps of a motion follow from all of these
    def _move(  # noqa: PLR0913
        self,
        equation: Equation,
        active: list[OscillatorMechanism],
        stimulus: Stimulus,
        values: FloatArray,
        start: FloatArray,
        steps_per_period: float | None,
        refine: int = 1,
        planned: Equation | None = None,
    ) -> _Motion:
        """Return the motion of lanes that share a drive, by steps that resolve it, or those of `planned`."""
        reach = max(stimulus.peak.get("displacement", 0.0), float(np.abs(start[:, 0]).max()), equation.rest())
        how, between = Plan(0, False), 1
        for _ in range(MOST_REFINEMENTS):
            wanted, instants = self.steps_of(
                planned or equation, active, stimulus, reach, steps_per_period, refine
            )
            check_work(wanted.substeps, stimulus.samples)
            if wanted.splitting == how.splitting and wanted.substeps <= how.substeps:
                break
            how, between = wanted, instants
            whole = self._drive(stimulus, active, values[0], how.substeps)
            count_work(
                len(values) * stimulus.samples * (STEPS_OF_A_READING + how.substeps * equation.step_cost)
            )
            every = how._replace(substeps=how.substeps // between)
            drive, acting = whole, None
            if "acceleration" in self.outputs:
                drive, acting = _acting_at(
                    whole, every.substeps, stimulus.samples, between, "acceleration" in stimulus.after_jumps
                )
            courses = equation.integrate(drive, every, start, acting)
            if "displacement" in stimulus.peak or (_diverged(courses[0]) >= 0).any():
                break
            reach = max(reach, float(np.abs(courses[0]).max()))
        return _Motion(courses, drive, every, between, acting)

    def _at_samples(
        self, motion: _Motion, stimulus: Stimulus, active: list[OscillatorMechanism], values: FloatArray
    ) -> dict[str, FloatArray]:
        """Return what is read of a motion at the samples, by output."""
        if any(mechanism.sensor is not None for mechanism in active):
            self._read(motion, stimulus, active, values)
        return {
            name: np.ascontiguousarray(course[:, :: motion.instants])
            for name, course in zip(self.outputs, motion.courses, strict=True)
        }

    # 6 parameters because a record's steps follow from all of these
    def steps_of(
        self,
        equation: Equation,
        active: list[OscillatorMechanism],
        stimulus: Stimulus,
        reach: float,
        steps_per_period: float | None = None,
        refine: int = 1,
    ) -> tuple[Plan, int]:
        """Return the steps between two samples of a record, and the instants of which a sensor is told.

        Raises:
            ValueError: No sensible step resolves the model.
        """
        untouched = not any(mechanism.acts_before_the_equation for mechanism in active)
        hold = stimulus.holds.get("drive", "linear") if untouched else ""
        largest = float(np.abs(stimulus.inputs["drive"]).max())
        swing = stimulus.swing.get("displacement", np.inf)
        duration_s = stimulus.period_s * stimulus.samples
        wanted = equation.plan(
            stimulus.period_s,
            reach,
            hold,
            steps_per_period,
            drive=largest,
            duration_s=duration_s,
            swing=swing,
        )
        sensed = any(mechanism.sensor is not None for mechanism in active)
        instants = LEAST if sensed and "acceleration" in self.outputs else 1
        if instants > 1 or any(mechanism.looks_between for mechanism in active):
            rate, _ = equation.rates(reach, largest, duration_s, swing)
            instants = max(instants, math.ceil(INSTANTS * rate * stimulus.period_s / (2.0 * math.pi)))
        return wanted._replace(substeps=instants * math.ceil(wanted.substeps * refine / instants)), instants

    def _read(
        self, motion: _Motion, stimulus: Stimulus, active: list[OscillatorMechanism], values: FloatArray
    ) -> None:
        """Put what the sensor reads in place of the response, in the courses of a motion; and its slope."""
        read, courses, substeps = self.outputs.index(self.response), motion.courses, motion.every.substeps
        responses, step_s, kinks = courses[read], stimulus.period_s / motion.instants, None
        slopes = courses[read + 1] if read + 1 < len(courses) else np.gradient(responses, step_s, axis=1)
        if self.response == "acceleration":
            steps, after = motion.instants * substeps, "acceleration" in stimulus.after_jumps
            begins, ends = motion.drive.nodes[:, 0], motion.drive.nodes[:, 2]
            kinks = kinks_of(begins, ends, steps, motion.instants, after=after)
        time_s = step_s * np.arange(responses.shape[1], dtype=np.float64)
        moved = Moved(responses[0], slopes[0], time_s, step_s, motion.drive, substeps, read, {}, kinks=kinks)
        for lane, own in enumerate(values):
            moved = moved._replace(displacement=responses[lane], velocity=slopes[lane])
            responses[lane], slopes[lane] = self._reading(moved, active, own)

    def _drive(
        self, stimulus: Stimulus, active: list[OscillatorMechanism], values: FloatArray, count: int
    ) -> Driven:
        """Return the drive that acts, beyond the last sample too where an acceleration is read after a jump there."""
        sampled = Sampled(
            stimulus.inputs["drive"],
            stimulus.period_s,
            stimulus.holds.get("drive", "linear"),
            onward=stimulus.onward.get("drive", np.empty(0)),
            within=any(one.bends for one in active),
        )
        for mechanism in sorted(active, key=lambda one: one.stage):
            if mechanism.input is not None:
                sampled = mechanism.input(sampled, self.values_of(mechanism, values))
        jumps = "zero" in (sampled.hold, *(hold for hold, _ in sampled.blend))
        beyond = int(jumps and "acceleration" in stimulus.after_jumps and "acceleration" in self.outputs)
        driven = Driven(cached(stimulus, sampled, count, beyond=beyond), stimulus.period_s / count)
        for mechanism in sorted(active, key=lambda one: one.stage):
            if mechanism.drive is not None:
                driven = mechanism.drive(driven, self.values_of(mechanism, values))
        return driven

    def _reading(
        self, moved: Moved, active: list[OscillatorMechanism], values: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the reading of one lane's motion; the sensor is not applied to a lane that diverged."""
        with np.errstate(invalid="ignore", over="ignore"):
            for mechanism in sorted(active, key=lambda one: one.stage):
                if mechanism.sensor is not None:
                    moved = mechanism.sensor(moved, self.values_of(mechanism, values))
        return moved.displacement, moved.velocity

    def _unread(self, reading: float, values: FloatArray) -> float:
        """Return the displacement at rest that the sensor of one lane reads so."""
        for mechanism in sorted(self.mechanisms, key=lambda one: -one.stage):
            if mechanism.unread is not None and self.acts(mechanism, values[None]):
                reading = mechanism.unread(reading, self.values_of(mechanism, values))
        return reading

    def acts(self, mechanism: OscillatorMechanism, values: FloatArray) -> bool:
        """Return whether any lane has a mechanism away from neutral: a neutral one is not there, to the last bit."""
        for k, parameter in enumerate(self.parameters):
            neutral = parameter.declared.neutral
            if (
                parameter.mechanism == mechanism.id
                and neutral is not None
                and (values[:, k] != neutral).any()
            ):
                return True
        return False

    def values_of(self, mechanism: OscillatorMechanism, values: FloatArray) -> Values:
        """Return the values of a mechanism in one lane (parameters,), by name."""
        return {
            parameter.declared.name: float(values[k])
            for k, parameter in enumerate(self.parameters)
            if parameter.mechanism == mechanism.id
        }


def _acting_at(
    drive: Driven, substeps: int, samples: int, instants: int, after_jump: bool
) -> tuple[Driven, FloatArray]:
    """Return the drive from the first sample to the last, and what of it acts at the instants, `substeps` apart."""
    steps = (samples - 1) * instants * substeps
    within, beyond = drive.nodes[:steps], drive.nodes[steps:]
    if after_jump:
        last = beyond[:1, 0] if len(beyond) else within[-1:, 2]
        acting = np.concatenate((within[::substeps, 0], last))
    else:
        acting = np.concatenate((within[:1, 0], within[substeps - 1 :: substeps, 2]))
    return drive._replace(nodes=within), acting


def _neutral(neutral: float | None, default: float | None) -> float:
    if neutral is not None:
        return neutral
    return 1.0 if default is None else default


def _diverged(displacement: FloatArray) -> IntArray:
    """Return the first sample (lanes,) of `displacement` (lanes, samples) that is not finite or absurd; -1: none."""
    low, high = displacement.min(axis=1), displacement.max(axis=1)  # NaN where one is
    first = np.full(len(displacement), -1, dtype=np.int64)
    for lane in np.flatnonzero(~((low > -ABSURD) & (high < ABSURD))):
        first[lane] = np.argmax(~(np.abs(displacement[lane]) < ABSURD))
    return first
