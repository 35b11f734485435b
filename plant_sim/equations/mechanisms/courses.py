"""What mechanisms do to the course of an input before the equations, and to that of an output after them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from plant_sim.equations.integration.inputs import input_nodes
from plant_sim.equations.mechanisms.mechanism import EquationsMechanism
from plant_sim.equations.system import System
from plant_sim.oscillator.integration.node_cache import cached
from plant_sim.oscillator.kinks import Kinks
from plant_sim.oscillator.mechanism import Driven, Moved, Sampled, Values
from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus


class Acting(NamedTuple):
    """A mechanism of a signal, and its values."""

    mechanism: EquationsMechanism
    values: Values


class Inputs(NamedTuple):
    """The inputs of some lanes, as they reach the equations."""

    stimulus: Stimulus
    system: System
    """The equations without added inputs."""
    factors: FloatArray
    """SI units (inputs,) of each input's unit in the record."""
    acting: Sequence[Acting] = ()
    late_s: float = 0.0
    """Time by which the readings are late: all inputs are so much earlier."""
    pushes: FloatArray | None = None
    """Samples (states, samples) [SI per s] that are added to the rates by further inputs; None: these are zero."""
    idle: int = 0
    """Number of further inputs."""

    def nodes(self, substeps: int) -> FloatArray:
        """Return the inputs (3, steps, inputs) [SI] at the start, middle and end of each step."""
        if not (self.acting or self.late_s or self.idle):
            return input_nodes(self.stimulus, self.system, self.factors, substeps)
        own = len(self.system.inputs)
        steps = (self.stimulus.samples - 1) * substeps
        made = np.zeros((3, steps, own + self.idle))
        for k, source in enumerate(self.system.inputs):
            made[:, :, k] = self.factors[k] * self._nodes_of(source.name, substeps).T
        for k, samples in enumerate(() if self.pushes is None else self.pushes):
            made[:, :, own + k] = _linear(samples, substeps)
        return made

    @property
    def jump(self) -> bool:
        """Whether an input may jump at a sample: one is held, or a mechanism may hold it."""
        return "zero" in self.stimulus.holds.values() or bool(self.acting)

    def after_the_last(self, substeps: int) -> FloatArray:
        """Return the inputs (inputs,) [SI] just after the last sample, were they to go on as they are there."""
        made = np.zeros(len(self.system.inputs) + self.idle)
        for k, source in enumerate(self.system.inputs):
            made[k] = self.factors[k] * self._nodes_of(source.name, substeps, beyond=1)[-substeps, 0]
        return made

    def _nodes_of(self, name: str, substeps: int, beyond: int = 0) -> FloatArray:
        stimulus = self.stimulus
        own = sorted(
            (one for one in self.acting if one.mechanism.signal == name),
            key=lambda one: one.mechanism.law.stage if one.mechanism.law else 0,
        )
        bends = any(one.mechanism.law.bends for one in own if one.mechanism.law)
        sampled = Sampled(
            stimulus.inputs[name], stimulus.period_s, stimulus.holds.get(name, "linear"), -self.late_s,
            onward=stimulus.onward.get(name, np.empty(0)), within=bends or bool(self.system.events),
        )  # fmt: skip
        for one in own:
            if one.mechanism.law and one.mechanism.law.input is not None:
                sampled = one.mechanism.law.input(sampled, one.values)
        driven = Driven(cached(stimulus, sampled, substeps, name, beyond), stimulus.period_s / substeps)
        for one in own:
            if one.mechanism.law and one.mechanism.law.drive is not None:
                driven = one.mechanism.law.drive(driven, one.values)
        return driven.nodes


def _linear(samples: FloatArray, substeps: int) -> FloatArray:
    """Return straight lines (3, steps) between samples (n,)."""
    at = np.arange(2 * (len(samples) - 1) * substeps + 1) / (2.0 * substeps)
    fine = np.interp(at, np.arange(len(samples)), samples)
    return np.stack((fine[:-1:2], fine[1::2], fine[2::2]))


# 6 parameters because a reading has a course, its kinks, and an instrument of two
def read(  # noqa: PLR0913
    course: FloatArray, step_s: float, acting: Sequence[Acting], reference: float, nodes: FloatArray,
    kinks: Kinks | None = None,
) -> FloatArray:  # fmt: skip
    """Return what an instrument reads of a course (n,), in its unit.

    Args:
        course: Output without an instrument's errors, at evenly spaced instants.
        step_s: Time between them [s].
        acting: Mechanisms of this output, with values.
        reference: Value from which saturations count.
        nodes: Unused input of the laws, which those of a drive read.
        kinks: Where the course has kinks, as its inputs have; None: nowhere.
    """
    time_s = step_s * np.arange(len(course), dtype=np.float64)
    slope = np.gradient(course, step_s)
    moved = Moved(course - reference, slope, time_s, step_s, Driven(nodes, step_s), 1, kinks=kinks)
    with np.errstate(invalid="ignore", over="ignore"):
        for one in sorted(acting, key=lambda one: one.mechanism.law.stage if one.mechanism.law else 0):
            if one.mechanism.law and one.mechanism.law.sensor is not None:
                moved = one.mechanism.law.sensor(moved, one.values)
    return moved.displacement + reference


def values_of(mechanism: EquationsMechanism, values: Mapping[str, float]) -> Acting:
    """Return a mechanism with its own of all `values` by "id.name"."""
    return Acting(mechanism, {one.name: values[f"{mechanism.id}.{one.name}"] for one in mechanism.parameters})
