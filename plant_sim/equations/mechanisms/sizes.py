"""Sizes of a system's signals and states along some motion, with which the parameters of mechanisms are compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from plant_sim.equations.mechanisms.words import output_reference, reference_of
from plant_sim.equations.system import System
from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import FreeParameter, Prediction, Stimulus

QUANTILES = (0.02, 0.1, 0.25, 0.5, 0.75, 0.9, 0.98)
"""Quantiles of a course that are kept."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Size:
    """Sizes of one course, in its unit."""

    rms: float = 1.0
    """About its reference: zero, or the start of a temperature."""
    deviation: float = 1.0
    """RMS about its mean."""
    rate: float = 1.0
    """RMS of its time derivative, per second."""
    quantiles: tuple[float, ...] = (1.0,) * len(QUANTILES)
    largest: float = 1.0
    """Largest magnitude."""


UNKNOWN = Size()


UNIT_SCALES = Scales(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sizes:
    """Sizes of everything that has a name, and of the time."""

    of: Mapping[str, Size] = field(default_factory=dict)
    scales: Scales = UNIT_SCALES
    """Sizes of the records; those of times are used."""

    def __getitem__(self, name: str) -> Size:
        """Return the sizes of a course; of one that is not known, 1."""
        return self.of.get(name, UNKNOWN)


NO_SIZES = Sizes()
"""Sizes of a simulation that knows no records: all 1."""


class Bound(Protocol):
    """A simulation of equations, as its sizes need it."""

    @property
    def system(self) -> System:
        """Return the equations."""
        ...

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """Return all parameters."""
        ...

    @property
    def output_factors(self) -> FloatArray:
        """Return SI units (outputs,) of the unit in which each output is given."""
        ...

    def predict(self, stimulus: Stimulus, values: FloatArray) -> Prediction:
        """See `Simulation.predict`."""
        ...


def sizes_along(
    simulation: Bound, stimuli: Sequence[Stimulus], measured: Sequence[Mapping[str, FloatArray]], scales: Scales
) -> Sizes:  # fmt: skip
    """Return the sizes of states along the simulation's own runs, of inputs and measured outputs as they are."""
    system, values = simulation.system, np.array([one.value for one in simulation.parameters])
    runs: list[Mapping[str, FloatArray]] = []
    for stimulus in stimuli:
        with suppress(ValueError):  # no sensible step: the check of the speed, or the fit, says so
            runs.append(
                {name: made[0] for name, made in simulation.predict(stimulus, values).outputs.items()}
            )
    period_s, sizes = scales.period, dict[str, Size]()
    for source in system.inputs:
        sizes[source.name] = size_of([one.inputs[source.name] for one in stimuli], period_s)
    for state in system.states:
        courses = [run[state.name] for run in runs if state.name in run]
        sizes[state.name] = size_of(courses, period_s, reference_of(state))
    for k, output in enumerate(system.outputs):
        courses = [one[output.name] for one in measured if output.name in one]
        reference = output_reference(system, output.name) / simulation.output_factors[k]
        sizes[output.name] = size_of(courses, period_s, reference)
    return Sizes(of=sizes, scales=scales)


def size_of(courses: Sequence[FloatArray], period_s: float, reference: float = 0.0) -> Size:
    """Return the sizes of the courses (n,) of one signal in several records; those that are not finite are left out."""
    whole = [one[np.isfinite(one)] for one in courses]
    values = np.concatenate(whole) if whole else np.empty(0)
    if len(values) < 2:
        return UNKNOWN
    rates = np.concatenate([np.gradient(one, period_s) for one in whole if len(one) > 1])
    deviation = _rms(values - values.mean())
    rms = _rms(values - reference) or 1.0
    return Size(
        rms=rms,
        deviation=deviation or rms,
        rate=_rms(rates) or rms,
        quantiles=tuple(np.quantile(values, QUANTILES).tolist()),
        largest=float(np.abs(values).max()) or 1.0,
    )


def _rms(values: FloatArray) -> float:
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.mean(values**2)))
