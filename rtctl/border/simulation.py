"""The protocol between what fits and doubts (rtctl) and what simulates (plant_sim): records in, predictions out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.mechanisms import Mechanism, Parameter


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class Stimulus:
    """What drove one record: inputs (n,) in the data's units, how they go on between samples, the start."""

    inputs: Mapping[str, FloatArray]
    holds: Mapping[str, str]
    """Of each input: "linear" | "zero" | "band-limited"."""
    period_s: float
    initial: Mapping[str, float] = field(default_factory=dict)
    """State at the first sample in the data's units; what is missing is at rest."""
    read: frozenset[str] = frozenset()
    """Of `initial`, what was read by the sensor: the state is what the model's sensor would read so."""
    peak: Mapping[str, float] = field(default_factory=dict)
    """Largest measured magnitude of each output, where it is known: the step is chosen for it."""
    swing: Mapping[str, float] = field(default_factory=dict)
    """Half of the range of each, where it is known: in one of two wells far less than `peak`."""
    onward: Mapping[str, FloatArray] = field(default_factory=dict)
    """Of an input, samples (m,) that came after these, where that is known: a band-limited one depends on them."""

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(next(iter(self.inputs.values())))


class FreeParameter(NamedTuple):
    """One number that a fit may move."""

    name: str
    """"damping", or "friction.coulomb.level" of a mechanism."""
    unit: str
    value: float
    low: float
    high: float
    fixed: bool
    declared: Parameter
    mechanism: str
    """Its mechanism's id; "" of the nominal model."""


class Prediction(NamedTuple):
    """Free-run outputs of several parameter sets (lanes)."""

    outputs: Mapping[str, FloatArray]
    """(lanes, samples) each, in the data's units; NaN from where a lane diverged."""
    diverged_at: IntArray
    """(lanes,) first sample that is no number or absurd; -1: none."""


class Simulation(Protocol):
    """A model bound to the units of a dataset. Holds no state of a run; may be called from several threads."""

    @property
    def kind(self) -> str:
        """Of plant: "oscillator"."""
        ...

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """The nominal ones, then each mechanism's."""
        ...

    @property
    def mechanisms(self) -> tuple[Mechanism, ...]:
        """Of this model, in its order."""
        ...

    @property
    def outputs(self) -> tuple[str, ...]:
        """What `predict` gives."""
        ...

    @property
    def state(self) -> tuple[str, ...]:
        """What an initial state consists of: "displacement", "velocity"."""
        ...

    def starting(self, stimulus: Stimulus, values: FloatArray) -> FloatArray:
        """State (states,) at the first sample: of what was read there, what the sensor of `values` (parameters,) would
        read so.
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
        """Simulate from the first sample; no measured output is fed in.

        `values` (lanes, parameters) in the order and units of `parameters`; `initial` (lanes, states) or the
        stimulus's own. `steps_per_period`: of the fastest pole; None: so many that the integrator is not the error.
        `refine`: so many times the steps, to see what the integrator adds to the error.
        """
        ...

    def extended(self, mechanisms: tuple[str, ...]) -> Simulation:
        """The same with these mechanisms added, at their neutral values (shapes at their defaults or scales)."""
        ...

    def with_values(self, values: FloatArray) -> Simulation:
        """The same model with `values` (parameters,) as its own."""
        ...
