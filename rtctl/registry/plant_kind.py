"""`PlantKind`: everything that the program knows of one kind of plant, in one frozen record.

The record is light. Parts that are expensive to import are given as "module:attribute" and imported when they are
first used; a user who has the object at hand gives the object itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from rtctl.border.records import DeviceProfile
from rtctl.registry.loading import resolved

Part = Any
"""An object, or "module:attribute" of one that is imported on first use; None where the kind of plant lacks it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalKind:
    """A signal in the datasets of a kind of plant."""

    role: str
    """"input" or "output"."""
    unit: str | None = None
    """Unit in which the signal is held; None: the manifest's own unit."""
    derivative_of: str | None = None
    """Signal of which this one is a time derivative: it is held in that signal's unit per second, if that is there."""
    derivatives: int = 1
    """Which derivative of `derivative_of` it is."""
    optional: bool = False
    """Whether the signal may be missing in a manifest or in single records."""
    not_in: tuple[str, ...] = ()
    """Units of what the signal cannot be: of the signals with which it is mixed up."""
    like: str = ""
    """Unit of the same dimension as the signal's must be; "": any."""
    stands_for: str = ""
    """Signal whose place it takes: it is held under that name, and a dataset has one of the two; "": none."""
    remark: str = ""
    """What a user must know of a dataset with this signal."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelFiles:
    """How models of a kind of plant are read, written and simulated."""

    read: Part
    """`(path: Path) -> model`; raises InputError."""
    simulation: Part
    """`(model, units, source) -> Simulation`: the model bound to the units of a dataset; `source` names its file."""
    write: Part = None
    """`(path: Path, model) -> None`."""
    mechanisms: Part = None
    """Mutable mapping of mechanism id to `Mechanism`, in the order of the catalogue."""
    mechanism_type: Part = None
    """Class of the mechanisms of this kind of plant; None: `rtctl.border.mechanisms.Mechanism`."""
    is_device: bool = False
    """Whether a model file also describes a simulated device, by its `[device]` table."""
    forced: Part = None
    """`(model, units, source) -> Forced`: the model under harmonic drive; None: there is no such simulation."""
    dynamics: Part = None
    """`(model, source) -> Dynamics`: the model as differential equations; None: it is none."""
    matlab_function: Part = None
    """`(model, source, name) -> str`: the model as the source of a MATLAB function; None: it has no such form."""
    c_plant: Part = None
    """`(model, source, request: CRequest) -> CPlant`: the model as C source; None: it has none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Control:
    """How a kind of plant is controlled by the parts that come with the program."""

    support: Part
    """`rtctl.plant_control.support.PlantSupport`, or a class of one without arguments."""
    several: Part | None = None
    """`(estimator, scenario, model) -> Estimator` of all outputs of a loop with [references]; None: it has one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Identification:
    """How a model of a kind of plant is identified from a dataset."""

    fit: Part
    """`(dataset, model, options, report) -> rtctl.api.identifying.fit.Fit`; `model` is where to start, or None."""
    options: Part
    """Class of `options`, a frozen record that checks its numbers."""
    option_names: Mapping[str, str]
    """Names of the options for users, each with its field of that class."""
    takes_model: bool = False
    """Whether the identification may start from a model."""
    excitation: str = ""
    """Bundled scenario by which `rtctl run` identifies a device for which no model was given; "": a model is needed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Defaults:
    """What a scenario need not say of a kind of plant."""

    limits: Mapping[str, float] = field(default_factory=dict)
    """Keys of `[limits]` in the units of the profile: "low", "high", "sensed_low", "sensed_high"."""
    frozen_after: int = 0
    """Equal readings after which a sensor counts as stuck [samples]; 0: never. Readings of a noisy sensor are never
    twice the same."""
    device: str | None = None
    """Bundled simulated device, or the name of a registered kind of plant."""
    estimator: str = "none"
    """Name of the estimator of a scenario without `[estimator]`."""
    controller: str | None = None
    """Name of the controller of a scenario without `[controller]`."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlantKind:
    """A kind of plant; all parts but the profile may be missing."""

    name: str
    """Name in files: `scenario.plant`, `dataset.plant`, `model.kind`."""
    summary: str = ""
    """One line for `rtctl list`."""
    profile: DeviceProfile
    """Commands, readings and reference of its devices, with units."""
    units_from: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Keys of `[scenario]` that set the units of a device, each with the channels that it is for; empty: the profile's
    own units hold."""
    signals: Mapping[str, SignalKind] = field(default_factory=dict)
    """Signals of a dataset by name; empty: there are no datasets of this kind."""
    free_signals: bool = False
    """Whether the user's model names the signals: a dataset may have any, each with its role and the manifest's unit;
    `initial` of a record then names states of the model, as quantities, which are held in SI base units."""
    responses: tuple[str, ...] = ()
    """Outputs of which at least one must be there; empty: `SignalKind.optional` says all."""
    has_sweeps: bool = False
    """Whether records may be sweeps of frequencies: steady states under a sine."""
    initial: tuple[str, ...] = ()
    """Signals whose value at the first sample a record may set under `initial`."""
    model: ModelFiles | None = None
    control: Control | None = None
    identification: Identification | None = None
    diagnosis: Part = None
    """`rtctl.diagnosis.problem.subject.Subject`, or several in the order of preference: the first whose signal the
    records have is taken. Of models whose signals are their own, `(simulation, dataset) -> Subject`. None: models of
    this kind are not diagnosed."""
    belief: Part = None
    """`(model) -> rtctl.doubt.belief.Belief`: the model in free run, by which a run is doubted; None: it is not."""
    retuned: Part = None
    """`(model, causes) -> model`: the model with `rtctl.doubt.naming.Answer`s that have begun while it controlled a
    device; raises InputError where one has no place in the loop. None: a run is not tuned anew while it lasts."""
    device: Part = None
    """Class of a simulated device (`plant_sim.plant.Plant`), called with the options of its `[plant]` table."""
    device_file: Part = None
    """`(path, seed) -> plant_sim.plant.Plant` of kinds that read plant files of their own, instead of `device`."""
    device_profile: Part = None
    """`(path) -> DeviceProfile` of the device of a model file, of kinds whose models name the channels
    (`free_signals`); a scenario then drives it by `scenario.model`."""
    defaults: Defaults = Defaults()

    def part(self, part: Part) -> Any:
        """Return `part` of this record, imported where it is given as "module:attribute"."""
        return resolved(part, f'plant "{self.name}"')

    @property
    def has_datasets(self) -> bool:
        """Whether there are datasets of this kind."""
        return self.free_signals or bool(self.signals)

    def signal(self, name: str, role: str) -> SignalKind | None:
        """Return what is known of a signal with this `role` in a manifest; None: there is no such signal."""
        return SignalKind(role=role) if self.free_signals else self.signals.get(name)

    @property
    def may_be_released(self) -> bool:
        """Return whether its motion may be measured while nothing drives it, without a column of its input."""
        return bool(self.responses)

    def without_stand_ins(self) -> PlantKind:
        """Return the kind of plant without the signals that stand for another one."""
        return replace(self, signals={name: one for name, one in self.signals.items() if not one.stands_for})

    def profile_in(self, units: Mapping[str, Any]) -> DeviceProfile:
        """Return the profile in the units that the keys of `units_from` give.

        Args:
            units: unit of each key, as in `[scenario]`; keys without a text are left out.
        """
        by_channel = {
            channel: str(units[key])
            for key, channels in self.units_from.items()
            if isinstance(units.get(key), str)
            for channel in channels
        }
        return self.profile.in_units(by_channel) if by_channel else self.profile
