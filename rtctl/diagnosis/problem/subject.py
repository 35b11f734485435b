"""What the diagnosis has to know of a kind of plant beyond its `Simulation`: signals, forces to test for, files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.cancellation import CancellationToken
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.thresholds import Thresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.noise.resonant_part import Resonance
from rtctl.identification.scales import estimate_scales
from rtctl.identification.simulation_error.sensitivity import Sensitivity
from rtctl.measured.dataset import Dataset, Record
from rtctl.models.derived.quantity import Derived

Signals = Mapping[str, FloatArray]
Reader = Callable[[Signals], dict[str, FloatArray]]
Records = Sequence[FitRecord]


class FittedModel(Protocol):
    """A fitted hypothesis as a kind of plant sees it."""

    @property
    def simulation(self) -> Simulation:
        """Simulation at the fitted values."""
        ...

    @property
    def sensitivity(self) -> Sensitivity:
        """Outputs that were fitted, and their derivatives."""
        ...

    def values_of(self, record: int) -> FloatArray:
        """Return all parameters (parameters,) of one record, in units."""
        ...

    def start(self, record: int) -> FloatArray:
        """Return the fitted initial state (states,) of one record."""
        ...


class FittedRecords(Protocol):
    """The records of a diagnosis problem as a kind of plant sees them."""

    @property
    def subject(self) -> Subject:
        """Kind of plant."""
        ...

    @property
    def records(self) -> tuple[FitRecord, ...]:
        """Records to fit."""
        ...

    @property
    def scales(self) -> Scales:
        """Sizes of what the records show."""
        ...

    @property
    def steps_per_period(self) -> float | None:
        """Integration steps of the fits in a period of the motion; None: the simulation's own."""
        ...

    @property
    def thresholds(self) -> Thresholds:
        """Numbers by which the diagnosis decides."""
        ...

    @property
    def cancellation(self) -> CancellationToken:
        """Request to stop, asked between fits."""
        ...

    def size(self, output: str) -> float:
        """Return the RMS of a measured output, in its unit."""
        ...


class RefittedParts(Protocol):
    """Identified parts of a model that were fitted anew, such as static loops; puts them into a simulation of it."""

    @property
    def loops(self) -> Mapping[str, Any]:
        """Fitted part by output."""
        ...

    def __call__(self, simulation: Simulation, /) -> Simulation:
        """Return `simulation` with the fitted parts."""
        ...


LEFT_OUT = (
    " (the extended model leaves out the gains and offsets that the fit had beside its causes: {} with them)"
)
"""Of a rehearsal, for `Rehearsal.with_corrections` in readable units."""


class Rehearsal(NamedTuple):
    """How well the loop does with today's model and with the extended one."""

    scenario: str
    """What was rehearsed, in words."""
    before: float
    """Error with today's model, in `unit`."""
    after: float
    """Error with the extended model; infinite where it gives none."""
    unit: str
    with_corrections: float | None = None
    """Error with the extended model and the corrections of the signals that the fit had beside its causes, where the
    model leaves these out because they do not help; None: it has all that the fit has."""

    def as_json(self) -> dict[str, Any]:
        """Return what `diagnosis.json` has of it."""
        return {name: value for name, value in self._asdict().items() if value is not None}


class Force(NamedTuple):
    """A force that is in no catalogue, as a direction in which the residual is tested."""

    name: str
    coordinate: str
    """Coordinate of the state space along which the force varies."""


class MemoryForces(NamedTuple):
    """Forces that are linear in the past of the motion."""

    forces: tuple[Force, ...]
    force_sensitivities: Callable[[FittedModel, FittedRecords, int], FloatArray]
    """Return what each force does to the outputs of a record, (forces, outputs, n)."""
    laws: tuple[str, ...]
    """Nonparametric alternatives that act in this way."""


class Levels(NamedTuple):
    """Parameters by which `sensor.quantisation` rounds one signal."""

    step: str
    """Name of the step."""
    level: str
    """Name of one of the levels."""


class DifferenceSteps(NamedTuple):
    """Steps of finite differences, as shares of a parameter's scale.

    Friction and dead bands have no derivative at zero, only a slope over a small step.
    """

    sizes: tuple[float, ...]
    """Steps that are tried one after the other until one changes the outputs by less than `small`."""
    small: float
    """Largest change of the outputs, as a share of their RMS: beyond it the response is curved, and the curvature
    looks like a direction of its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """What the diagnosis knows of a kind of plant."""

    kind: str
    """Name of the kind of plant."""
    drive: str
    """Name of the input."""
    output: str
    """Name of the output in which the gain is measured."""
    required_signal: str
    """Signal that a record of a dataset must have; `output` is computed from it."""
    clippable_outputs: tuple[str, ...]
    """Outputs in which a clipped sensor is looked for."""
    spike_outputs: tuple[str, ...]
    """Outputs in which single readings may be spikes."""
    size_is_variation: bool
    """Whether the size of an output is its standard deviation; otherwise its RMS."""
    forces: tuple[Force, ...]
    """Forces whose effect on the residual is tested."""
    force_sensitivities: Callable[[FittedModel, FittedRecords, int], FloatArray]
    """Return what each of `forces` does to the outputs of a record, (forces, outputs, n)."""
    difference_steps: DifferenceSteps
    """Steps of finite differences along directions."""
    memory_forces: MemoryForces | None
    """Forces that a set of causes which passes the residual tests is also tested for; None: there are none."""
    nonparametric_alternatives: tuple[str, ...]
    """Mechanisms in no catalogue, the fastest first: a set of causes that leaves a misfit is not named if one of these
    leaves less."""
    sensed_rms: Callable[[Records], float]
    """Return the RMS of what is read in place of the motion; see `Scales`."""
    lag_s: Callable[[Scales], float]
    """Return the interval [s] at which the past of motion and drive is sampled in tests."""
    time_parameter: str = ""
    """Parameter of the nominal model that is its time constant [s]; "": none."""
    slower_sampling: tuple[int, ...]
    """Multiples of the sample period that a next experiment may use: the effect of the drive's hold scales with the
    period, that of a delay or a lag does not. Empty where the hold is known."""
    is_at_rest_undriven: bool
    """Whether a record without any input tells nothing; otherwise it may ring down."""
    growth_is_misfit: bool
    """Whether a residual that grows with the motion cannot be noise."""
    allowed_share: float
    """Largest RMS misfit of a nominal model of this kind that counts as no gap, as a share of an output's size;
    0: none."""
    stated_misfit: Callable[[Any, Dataset], Mapping[str, float]]
    """Return the RMS misfit by output that a model's identification states as its limit; empty where it states none."""
    doubt: Callable[[Any], str] = lambda model: ""
    """Return why a model's own identification is to be done again before it is diagnosed; "" where it is not."""
    least_share_removed: float
    """Causes are named only if they remove at least this share of the squared misfit, or leave nothing."""
    steps_per_period: float
    """Integration steps of the fits in a period of the motion, as in `Simulation.predict`: their errors cancel in
    differences; the gain is measured at full accuracy."""
    screening_samples: int | None
    """Samples of all records together by which a hypothesis is screened; None: all."""
    to_comparable: Callable[[Simulation, Records], tuple[Simulation, Reader]]
    """Return the simulation with outputs whose errors have one size over the whole range, and the function that brings
    measured outputs into the same form, for the records to fit."""
    from_comparable: Callable[[Simulation], Simulation]
    """Undo `to_comparable`."""
    find_coarse_parts: Callable[[Any, Dataset], Mapping[str, Any]]
    """Return, by output, identified parts of a model that are too coarse for the records of the identification."""
    find_identified_parts: Callable[[Any, Dataset], Mapping[str, Any]]
    """Return, by output, all such parts; empty where the dataset lacks the records of the identification."""
    refit_parts: (
        Callable[[Mapping[str, Any], FittedModel, FittedRecords, Callable[[str], None]], RefittedParts] | None
    )
    """Fit these parts anew, also to the fitted records, with the causes of a hypothesis acting; the last argument is
    called with the output under way. None: the kind has no such parts."""
    session_corrections: Mapping[str, float]
    """Nominal parameters in which a session may differ from the identification, and their values there."""
    output_offsets: Mapping[str, str]
    """Nominal parameter that is added to an output, by output."""
    offset_mechanism: str
    """Mechanism that adds a constant to the reading; "": none is needed."""
    levels: Mapping[str, Levels]
    """Parameters that round a signal, by signal."""
    is_steady: bool = False
    """Whether it is diagnosed by sweeps of frequencies, whose rows are steady states."""
    tells_nothing: Callable[[FittedModel, FittedRecords, int], NDArray[np.bool_]] | None = None
    """Return the samples (n,) of a record that any small change of the model moves far, so that they tell of none."""
    reads_initial_states: bool = True
    """Whether the state at any sample can be read from what was measured; otherwise records are never cut into pieces,
    each from its own initial state."""
    takes_scenarios: bool = True
    """Whether `rtctl acquire` runs scenarios of this kind of plant, so that an experiment can be proposed."""
    noise_starts_white: bool = False
    """Whether the noise is first taken as white. Where all that a model does is slow, the directions of the catalogue
    span all slow residuals, and the colour of what they leave would be that of a hole there."""
    output_units: Mapping[str, str] = field(default_factory=dict)
    """Units of the outputs that `to_comparable` makes, by name."""
    state_units: Mapping[str, str] = field(default_factory=dict)
    """Units of the states whose starts no reading tells, by name: the model file has them."""
    coarse_part_units: Mapping[str, str] = field(default_factory=dict)
    """Units of the misfits of coarse parts, by output."""
    coarse_part_readings: Mapping[str, str] = field(default_factory=dict)
    """Reading that is fitted, by output that may be coarse."""
    describe_coarse_parts: Callable[[Mapping[str, Any]], str] | None = None
    """Return the part of a sentence that says what coarse parts leave; None where there are none."""
    coarse_part_figure: Callable[[Mapping[str, Any], Mapping[str, Any], Mapping[str, str]], Any] | None = None
    """Draw coarse parts beside those fitted anew, in the units of the dataset; a Matplotlib figure."""
    find_initial_state: Callable[[Simulation, FitRecord], FitRecord] | None = None
    """Return a record with the state in which it begins, where its first readings show that it was not at rest; None:
    the fits find that state."""
    resonances: Callable[[Simulation], Sequence[Resonance]] = lambda simulation: ()
    """Return the resonances of a fitted model, at which a noise may have what an unmeasured force does."""
    describe_response: Callable[[Simulation], str] = lambda simulation: ""
    """Return a sentence on a fitted nominal model whose response may be another kind of plant's; "" where it is not."""
    derive: Callable[
        [Any, Mapping[str, Mapping[str, Estimate]], Mapping[str, str], FittedRecords], Sequence[Derived]
    ] = lambda model, estimates, units, problem: ()
    """Return what follows from a model and the estimates of its parameters, by mechanism ("": the nominal model) and
    name, in the terms of those who use the device; signals in `units`, on these records."""
    describe_screened: Callable[[Simulation], Sequence[str]] = lambda simulation: ()
    """Return notes on the model as `to_comparable` made it."""
    rehearse: Callable[[Any, Any, Sequence[Record]], Rehearsal | None] | None = None
    """Rehearse the loop on measured records with today's and with the extended model; None where no loop uses them."""
    read_model: Callable[[Path], Any]
    """Read a model file. Raises InputError."""
    relative_errors: Callable[[Any], Mapping[str, float]]
    """Return standard error over value of each model parameter whose file states an interval."""
    extended_model: Callable[[Any, Simulation, Mapping[str, Mapping[str, Estimate]]], Any]
    """Return a file's model with values and mechanisms of a fitted simulation, and the estimates (with intervals) of
    its parameters by mechanism ("": the nominal model) and name."""
    with_starts: Callable[[Any, Sequence[str], Sequence[FitRecord], Sequence[FloatArray]], Any] | None = None
    """Return a model that begins where fitted records do: `(model, states, records, their initial states)`. None:
    models of this kind have no start of their own, a record begins at its first reading."""
    write_model: Callable[[Path, Any, dict[str, Any]], None]
    """Write a model to a file, with its provenance."""

    def scales(self, records: Records, simulation: Simulation | None = None) -> Scales:
        """Return the sizes of what these records show, and the time constant of their model, if that is given."""
        parameters = simulation.parameters if simulation else ()
        named = [one.value for one in parameters if one.name == self.time_parameter]
        return estimate_scales(records, self.output, self.drive)._replace(
            sensed=self.sensed_rms(records), response_s=named[0] if named else 0.0
        )

    @property
    def coordinates(self) -> Sequence[str]:
        """Return the coordinates of its forces, each once."""
        return tuple(dict.fromkeys(force.coordinate for force in self.forces))
