"""Protocol between identification and diagnosis (rtctl) and simulations: records in, predictions out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.mechanisms import Mechanism, Parameter


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class Stimulus:
    """Inputs (n,) of one record in the data's units, how they continue between samples, and the start."""

    inputs: Mapping[str, FloatArray]
    holds: Mapping[str, str]
    """Hold of each input: "linear" | "zero" | "band-limited"."""
    period_s: float
    initial: Mapping[str, float] = field(default_factory=dict)
    """State at the first sample in the data's units; missing states are at rest."""
    read: frozenset[str] = frozenset()
    """Names in `initial` that were read by the sensor: the state is that which the model's sensor would read so."""
    peak: Mapping[str, float] = field(default_factory=dict)
    """Largest measured magnitude of each output, where it is known: the step is chosen for it."""
    swing: Mapping[str, float] = field(default_factory=dict)
    """Half of the range of each output, where it is known: in one of two wells far less than `peak`."""
    count: int = 0
    """Number of samples where there is no input, of a device that nothing drives."""
    onward: Mapping[str, FloatArray] = field(default_factory=dict)
    """Known samples (m,) of an input after these: a band-limited one depends on them."""

    after_jumps: frozenset[str] = frozenset()
    """Outputs that are read just after an input jumps at their sample, and not just before."""

    guide: Mapping[str, FloatArray] = field(default_factory=dict)
    """Measured outputs by which a simulation chooses among motions that all settle; empty: the rows before decide."""

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(next(iter(self.inputs.values()))) if self.inputs else self.count


class FreeParameter(NamedTuple):
    """One parameter that a fit may move."""

    name: str
    """"damping", or "friction.coulomb.level" of a mechanism."""
    unit: str
    value: float
    low: float
    high: float
    fixed: bool
    declared: Parameter
    mechanism: str
    """Id of its mechanism; "" for the nominal model."""


def with_parameter_values(
    parameters: tuple[FreeParameter, ...], values: FloatArray
) -> tuple[FreeParameter, ...]:
    """Return `parameters` with `values` (parameters,) as their own."""
    moved = zip(parameters, np.asarray(values, dtype=np.float64).tolist(), strict=True)
    return tuple(parameter._replace(value=value) for parameter, value in moved)


class Prediction(NamedTuple):
    """Free-run outputs of several parameter sets (lanes)."""

    outputs: Mapping[str, FloatArray]
    """Outputs (lanes, samples) in the data's units; NaN from where a lane diverged."""
    diverged_at: IntArray
    """First sample (lanes,) that is not finite or absurd; -1: none."""


class Simulation(Protocol):
    """A model bound to the units of a dataset. Holds no state of a run; may be called from several threads."""

    @property
    def kind(self) -> str:
        """Kind of plant, such as "oscillator"."""
        ...

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """Parameters: the nominal ones, then each mechanism's."""
        ...

    @property
    def mechanisms(self) -> tuple[Mechanism, ...]:
        """Mechanisms of this model, in its order."""
        ...

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs of `predict`."""
        ...

    @property
    def state(self) -> tuple[str, ...]:
        """Names of the states: "displacement", "velocity"."""
        ...

    def starting(self, stimulus: Stimulus, values: FloatArray) -> FloatArray:
        """Return the state (states,) at the first sample.

        Where a state was read there, it is the one that the sensor with `values` (parameters,) would read so.
        """
        ...

    def predict(
        self,
        stimulus: Stimulus,
        values: FloatArray,
        initial: FloatArray | None = None,
        steps_per_period: float | None = None,
        refine: int = 1,
    ) -> Prediction:
        """Simulate from the first sample without measured outputs.

        Args:
            stimulus: Inputs and start.
            values: (lanes, parameters) in the order and units of `parameters`.
            initial: (lanes, states), or None for the stimulus's own start.
            steps_per_period: Integrator steps of the fastest pole's period; None: so many that their error is
                negligible.
            refine: Factor on the number of steps, to see what the integrator adds to the error.
        """
        ...

    def extended(self, mechanisms: tuple[str, ...]) -> Simulation:
        """Return the same model with these mechanisms at neutral values (shapes at their defaults or scales)."""
        ...

    def with_values(self, values: FloatArray) -> Simulation:
        """Return the same model with `values` (parameters,) as its own."""
        ...


@runtime_checkable
class HasDepartures(Protocol):
    """A simulation that tells cheaply what a mechanism would do which it lacks."""

    def predict_departures(
        self,
        extended: Any,
        stimulus: Stimulus,
        values: FloatArray,
        initial: FloatArray,
        steps_per_period: float | None = None,
    ) -> Prediction:
        """Return what `extended` predicts, to the first order in the amplitude of its last mechanism.

        Args:
            extended: The same with one mechanism more.
            stimulus: Inputs.
            values: (lanes, parameters) of `extended`; lanes differ in that mechanism's parameters alone.
            initial: (states,) at the start of all lanes.
            steps_per_period: As of `Simulation.predict`.
        """
        ...


@runtime_checkable
class HasForces(Protocol):
    """A simulation of an equation of motion, whose forces can be taken along a motion that was measured."""

    def forces_along(
        self,
        extended: Any,
        stimulus: Stimulus,
        values: FloatArray,
        displacement: FloatArray,
        velocity: FloatArray,
    ) -> FloatArray | None:
        """Return the mean force per mass over each sample period that the last mechanism of `extended` exerts.

        Args:
            extended: The same with one mechanism more.
            stimulus: Inputs.
            values: (lanes, parameters) of `extended`.
            displacement: (n,) at the samples.
            velocity: (n,) at the samples.

        Returns:
            (lanes, n - 1); None where it exerts none, or one that depends on more than the motion.
        """
        ...


@runtime_checkable
class HasCatalogue(Protocol):
    """A simulation whose mechanisms are its own and not those of its kind of plant."""

    @property
    def catalogue(self) -> tuple[str, ...]:
        """Ids of the mechanisms that may act in it."""
        ...
