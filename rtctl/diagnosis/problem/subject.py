"""What the diagnosis has to know of a kind of plant beyond its `Simulation`: its signals, forces of no name, files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.cancellation import CancellationToken
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.thresholds import Thresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales
from rtctl.identification.simulation_error.sensitivity import Sensitivity
from rtctl.measured.dataset import Dataset

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


class Placed(Protocol):
    """What was identified of a model, learned anew: puts it into any simulation of that model."""

    @property
    def loops(self) -> Mapping[str, Any]:
        """By output."""
        ...

    def __call__(self, simulation: Simulation, /) -> Simulation:
        """Return `simulation` with it."""
        ...


class Force(NamedTuple):
    """One that has no name in the catalogue, and the coordinate along which it lives."""

    name: str
    coordinate: str


class Past(NamedTuple):
    """Forces that are linear in the past of the motion, and the laws of no name that act so."""

    forces: tuple[Force, ...]
    slopes: Callable[[FittedModel, FittedRecords, int], FloatArray]
    """(forces, outputs, n) of a record."""
    laws: tuple[str, ...]


class Steps(NamedTuple):
    """Of a parameter's scale: friction and deadbands have no derivative at 0, only a slope over a small step."""

    sizes: tuple[float, ...]
    """One after the other, until one moves the outputs little."""
    small: float
    """Of the outputs' RMS: beyond it a slope is bent, and the bend looks like a direction of its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """A kind of plant as the diagnosis sees it."""

    kind: str
    drive: str
    """Name of the input."""
    output: str
    """Of the output that the gain is measured in."""
    signal: str
    """Of a dataset, that a record must have: what `output` is read from."""
    clipping_of: tuple[str, ...]
    """Outputs that a clipped sensor would be seen in."""
    spikes_of: tuple[str, ...]
    """Outputs in which single readings may be spikes."""
    about_mean: bool
    """Whether an output's size is that of its variation; else that of its distance from zero."""
    forces: tuple[Force, ...]
    slopes: Callable[[FittedModel, FittedRecords, int], FloatArray]
    """(forces, outputs, n) of a record: what each force does to the outputs."""
    steps: Steps
    """Of finite differences along directions."""
    past: Past | None
    """What a set that passes the gate is asked as well; None: nothing."""
    unnamed: tuple[str, ...]
    """Mechanisms in no catalogue: a set of causes that leaves something is not told if one of these leaves less. Those
    that take least time first."""
    sensed: Callable[[Records], float]
    """RMS of what is read in place of the motion; see `Scales`."""
    lag_s: Callable[[Scales], float]
    """Between two looks at the past of motion and drive."""
    slower: tuple[int, ...]
    """Times the period of the records so far, at which a next experiment may be sampled: what holds the drive between
    samples goes with the period, a delay or a lag does not. Empty where the hold is known.
    """
    is_at_rest_undriven: bool
    """Whether a record without any input says nothing; else it may ring down."""
    grows_with_motion: bool
    """Whether a residual that grows with the motion cannot be noise."""
    allowed_share: float
    """Of an output's size, the most RMS misfit of the nominal models of this kind that is no gap; 0: none."""
    promised: Callable[[Any, Dataset], Mapping[str, float]]
    """RMS misfit, by output, that a model's identification promises not to exceed; empty where nothing says."""
    least_removed: float
    """Of the squared misfit of the re-fitted nominal model: causes that remove less, and leave some, are not named."""
    steps_per_period: float
    """Of the fits, as `Simulation.predict` has it: their errors cancel in the differences that are tested; the gain is
    measured at the full number."""
    glance_samples: int | None
    """Of all records together, that a first look at each hypothesis takes; None: all."""
    comparable: Callable[[Simulation, Records], tuple[Simulation, Reader]]
    """The simulation with outputs whose errors are of one size over the whole range, and what puts measured outputs
    in the same form; by the records that are fitted."""
    inner: Callable[[Simulation], Simulation]
    """Back from `comparable`."""
    coarse: Callable[[Any, Dataset], Mapping[str, Any]]
    """Identified parts of a model, by output, that the records they were identified from show to be too coarse; empty
    where they show no such thing."""
    identified: Callable[[Any, Dataset], Mapping[str, Any]]
    """The same parts whatever those records show; empty where the dataset has none of them."""
    relearned: Callable[[Mapping[str, Any], FittedModel, FittedRecords, Callable[[str], None]], Placed] | None
    """These parts from the fitted records too, behind the hypothesis's causes; the last argument hears
    each. None where there are none."""
    corrections: Mapping[str, float]
    """Nominal parameters by which a session may differ from the identification's, and their values there."""
    offsets: Mapping[str, str]
    """Of outputs, the nominal parameter that is added to it."""
    shifted_by: str
    """Mechanism that adds a constant to the reading; "": none, or the nominal model has one."""
    output_units: Mapping[str, str] = field(default_factory=dict)
    """Units of the outputs that `comparable` makes, by name."""
    coarse_units: Mapping[str, str] = field(default_factory=dict)
    """Units of the misfits of `coarse` parts, by output."""
    describe_coarse: Callable[[Mapping[str, Any]], str] | None = None
    """Sentence part that says what `coarse` parts leave; None where there are none."""
    coarse_figure: Callable[[Mapping[str, Any], Mapping[str, Any], Mapping[str, str]], Any] | None = None
    """Matplotlib figure of `coarse` parts beside the `relearned` ones, by the units of the dataset."""
    read_model: Callable[[Path], Any]
    spreads: Callable[[Any], Mapping[str, float]]
    """Standard errors over values, by name, of a model's parameters whose file has an interval."""
    extended_model: Callable[[Any, Simulation, Mapping[str, Mapping[str, Estimate]]], Any]
    """Return the model of a file with the values and mechanisms of a fitted simulation, and the estimates (with their
    intervals) of its parameters by mechanism ("": the nominal model) and name."""
    write_model: Callable[[Path, Any, dict[str, Any]], None]
    """To a file, with its provenance."""

    def scales(self, records: Records) -> Scales:
        """Sizes of what these records show."""
        return estimate_scales(records, self.output, self.drive)._replace(sensed=self.sensed(records))

    @property
    def rest(self) -> str:
        """What a model that is adequate leaves, in words."""
        if not self.allowed_share:
            return "noise"
        share = f"at most {self.allowed_share:.1%} of an output's variation"
        return f"noise, or what the model's identification may have left ({share})"

    @property
    def coordinates(self) -> Sequence[str]:
        """Along which its forces live, each once."""
        return tuple(dict.fromkeys(force.coordinate for force in self.forces))
