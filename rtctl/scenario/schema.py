"""A scenario file: everything about a run that a person decides, checked before anything moves.

Tables: `scenario`, `driver`, `clock`, `limits`, `safety`, and either `reference`, `estimator`, `controller`, or
`excitation` (one table each).
"""

from __future__ import annotations

import copy
import tomllib
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import AfterValidator, Discriminator, Field, Tag, create_model, field_validator, model_validator

from rtctl.border.errors import InputError
from rtctl.border.file_kinds import check_file_kind
from rtctl.border.importing import look_beside
from rtctl.border.records import DeviceProfile
from rtctl.border.units.quantities import Checked, check, read_toml
from rtctl.registry import DEFAULT_PLANT, PlantKind, entries, load, plant_kind
from rtctl.scenario.channels import ChannelsTable, fill_channels, known_unit
from rtctl.scenario.channels import profile_of as channels_profile
from rtctl.scenario.clock import ClockTable, Seconds
from rtctl.scenario.drivers import DriverTable, Serial
from rtctl.scenario.further_references import FurtherReferences
from rtctl.scenario.instruments import Scpi
from rtctl.scenario.limits import LimitsTable, limits_table
from rtctl.scenario.own_parts import OwnController, OwnEstimator, OwnPart, chosen_by_kind
from rtctl.scenario.safety import SafetyTable
from rtctl.signals.excitations import Excitation
from rtctl.signals.levels import whole_microseconds
from rtctl.signals.references import Reference


class Heading(Checked):
    """[scenario]; `_heading_of` adds the keys that set the units of a kind of plant."""

    title: str
    plant: str = DEFAULT_PLANT
    model: str | None = None
    """Model file beside the scenario that applies where `--model` is not given."""
    any_device: bool = False
    """Run although the model was identified on a device of another identity."""
    period_s: Annotated[Seconds, Field(alias="period", gt=0.0)] = 1e-3
    duration_s: Annotated[Seconds | None, Field(alias="duration", gt=0.0)] = None

    @field_validator("plant")
    @classmethod
    def _known_plant(cls, plant: str) -> str:
        try:
            plant_kind(plant)
        except InputError as error:
            raise ValueError(str(error).removeprefix('key "scenario.plant": ')) from None
        return plant

    @model_validator(mode="after")
    def _has_units(self) -> Heading:
        keys = plant_kind(self.plant).units_from
        if any(getattr(self, key, None) is None for key in keys):
            raise ValueError(
                f'a "{self.plant}" needs {" and ".join(keys)}, such as "mm" or "m/s^2": the units of the '
                "numbers on its wire"
            )
        return self

    @property
    def profile(self) -> DeviceProfile:
        """Profile of the device that the scenario drives."""
        kind = plant_kind(self.plant)
        return kind.profile_in({key: getattr(self, key, None) for key in kind.units_from})

    @model_validator(mode="after")
    def _whole_steps(self) -> Heading:
        whole_microseconds(self.period_s)
        if self.duration_s is not None and round(self.duration_s / self.period_s) < 1:
            raise ValueError(
                f"duration = {self.duration_s:g} s is shorter than the period {self.period_s:g} s"
            )
        return self


class ModelHeading(Heading):
    """[scenario] of a kind of plant whose models name the channels of a device."""

    channels: ChannelsTable

    @property
    def profile(self) -> DeviceProfile:
        """Profile of the device that the scenario drives."""
        return self.channels.profile(self.plant)


class EstimatorTable(Checked):
    """[estimator] with an estimator of the program: one line exchanges it."""

    union_tag: ClassVar[str] = "ours"

    kind: str


def _estimator_tag(table: Any) -> str | None:
    if not isinstance(table, dict | Checked):
        return EstimatorTable.union_tag  # no table at all: a finding of any member
    kind = table.get("kind") if isinstance(table, dict) else getattr(table, "kind", None)
    if kind is None:
        return None
    ours = [entry.name for entry in entries("estimator") if not entry.is_own]
    return EstimatorTable.union_tag if kind in ours else OwnPart.union_tag


AnyEstimator = Annotated[
    Annotated[EstimatorTable, Tag(EstimatorTable.union_tag)]
    | Annotated[OwnEstimator, Tag(OwnPart.union_tag)],
    Discriminator(_estimator_tag),
]


class ChecksTable(Checked):
    """[checks]: upper bounds, in percent of the output's range or as their names say; missing one is exit 1."""

    tracking_mean_percent: Annotated[float, Field(gt=0.0)] | None = None
    tracking_max_percent: Annotated[float, Field(gt=0.0)] | None = None
    self_sensing_mean_percent: Annotated[float, Field(gt=0.0)] | None = None
    self_sensing_max_percent: Annotated[float, Field(gt=0.0)] | None = None
    settle_after_s: Annotated[Seconds | None, Field(alias="settle_after", ge=0.0)] = None
    """No bound: how long after a new setpoint its level counts as settled."""
    hold_max_percent: Annotated[float, Field(gt=0.0)] | None = None
    """How far the settled output may be from the setpoint at any sample, in percent of it."""
    settling_max_ms: Annotated[float, Field(gt=0.0)] | None = None
    """Until the output stays within 1 % of a new setpoint."""
    backbone_max_hz: Annotated[float, Field(gt=0.0)] | None = None
    """How far the mean frequency of a settled level may be from the model's backbone."""

    @model_validator(mode="after")
    def _settled(self) -> ChecksTable:
        if self.settle_after_s is None:
            for name in ("hold_max_percent", "backbone_max_hz"):
                if getattr(self, name) is not None:
                    raise ValueError(f'{name} needs settle_after, such as "100 ms"')
        return self

    def bounds(self) -> dict[str, float]:
        """Those that are set, by name."""
        found: dict[str, float] = self.model_dump(exclude_none=True, exclude={"settle_after_s"})
        return found


class PaperTable(Checked):
    """[paper]: the published figures that stand beside ours, in percent of range."""

    tracking_mean: float | None = None
    tracking_max: float | None = None
    self_sensing_mean: float | None = None
    self_sensing_max: float | None = None


class Scenario(Checked):
    """A whole scenario file."""

    scenario: Heading
    driver: DriverTable
    clock: ClockTable = ClockTable()
    limits: LimitsTable
    safety: SafetyTable = SafetyTable()
    reference: Reference | None = None
    references: FurtherReferences = Field(default_factory=dict)
    """What further outputs track, by their names in the model."""
    excitation: tuple[Excitation, ...] = ()
    estimator: AnyEstimator
    controller: Any = None
    """Table of a controller, of the program or of the user (`rtctl.scenario.own_parts.OwnController`); None where the
    kind of plant has no default."""
    checks: ChecksTable = ChecksTable()
    paper: PaperTable = PaperTable()

    @property
    def profile(self) -> DeviceProfile:
        """Return the profile of the device that the scenario drives."""
        return self.scenario.profile

    @model_validator(mode="after")
    def _one_purpose(self) -> Scenario:
        if (self.reference is None) == (not self.excitation):
            raise ValueError("a scenario has either a [reference] to track or [[excitation]] tables to play")
        if self.reference is not None and self.scenario.duration_s is None:
            raise ValueError('key "scenario.duration" is missing: a [reference] does not end by itself')
        return self

    @model_validator(mode="after")
    def _several_outputs(self) -> Scenario:
        if not self.references:
            return self
        control = plant_kind(self.scenario.plant).control
        if control is None or control.several is None:
            raise ValueError(f'[references]: a "{self.scenario.plant}" has one controlled output')
        if self.reference is None:
            raise ValueError(
                "[references] stand beside a [reference] of the output that device.reference names"
            )
        if self.safety.rearm:
            raise ValueError(
                "safety.rearm: a loop of several outputs does not go on after a fault; leave it out"
            )
        own = self.profile.reference.name.removeprefix("reference_")
        if own in self.references:
            raise ValueError(f"[references.{own}]: this output has the [reference] already")
        return self

    @model_validator(mode="after")
    def _pipelined_live(self) -> Scenario:
        if isinstance(self.driver, Serial) and self.driver.pipeline and self.clock.mode == "lockstep":
            raise ValueError(
                f"driver.pipeline = {self.driver.pipeline} needs clock.mode = live: in lockstep the device waits for "
                "each command, and a slow wire costs no delay"
            )
        return self

    @model_validator(mode="after")
    def _instrument_in_time(self) -> Scenario:
        if isinstance(self.driver, Scpi):
            self.driver.check_clock(self.clock.mode, self.scenario.period_s)
        return self

    def at_period_of(self, record: int) -> Scenario:
        """Return the same scenario at the period of an excitation that has one of its own."""
        period_s = self.excitation[record].period_s
        if period_s is None:
            return self
        return self.model_copy(update={"scenario": self.scenario.model_copy(update={"period_s": period_s})})

    @property
    def reading_delay(self) -> int:
        """Periods between a command and the first reading that knows of it, beyond one: what the tuning reckons with.

        Lockstep 0. Live 1: a reading is from before the command of its own exchange takes effect; pipelined so many
        more as answers are under way.
        """
        if self.clock.mode == "lockstep":
            return 0
        return 1 + (self.driver.pipeline if isinstance(self.driver, Serial) else 0)


def load_scenario(path: Path, overrides: list[str]) -> tuple[Scenario, dict[str, Any]]:
    """Return the checked scenario and its tables after `--set KEY=VALUE` overrides. Raises InputError."""
    found = read_toml(path)
    check_file_kind(found, path, "scenario")
    tables = overridden(found, overrides)
    if isinstance(driver := tables.setdefault("driver", {}), dict):
        driver.setdefault("kind", "inprocess")
    look_beside(path.parent)
    return checked_scenario(tables, str(path), path.parent), tables


def overridden(tables: dict[str, Any], overrides: list[str]) -> dict[str, Any]:
    """`tables` with `KEY=VALUE` overrides applied in place. Raises InputError."""
    for override in sorted(overrides, key=lambda text: not text.partition("=")[0].endswith(".kind")):
        _apply(tables, override)  # kinds first: another kind empties its table
    return tables


def checked_scenario(tables: dict[str, Any], source: str, folder: Path = Path()) -> Scenario:
    """Return the scenario that `tables` are; the channels of a model are written into them.

    Args:
        tables: Tables of a file or recording.
        source: Its name in messages.
        folder: Folder beside which its model is looked up.

    Raises:
        InputError: Something in it is wrong.
    """
    kind = _kind_of(tables)
    if kind.free_signals:
        fill_channels(tables, kind, folder, source)
        profile = channels_profile(tables, kind, source)
    else:
        profile = kind.profile_in(_heading_table(tables))
    return check(
        _scenario_of(kind, profile), _with_defaults(tables, kind), source, context={"profile": profile}
    )


def _heading_table(tables: dict[str, Any]) -> dict[str, Any]:
    heading = tables.get("scenario")
    return heading if isinstance(heading, dict) else {}


def _kind_of(tables: dict[str, Any]) -> PlantKind:
    """Return the kind of `scenario.plant`; of an unknown one, which is a finding of its own, the default kind."""
    name = _heading_table(tables).get("plant", DEFAULT_PLANT)
    try:
        return plant_kind(str(name))
    except InputError:
        return plant_kind(DEFAULT_PLANT)


def _with_defaults(tables: dict[str, Any], kind: PlantKind) -> dict[str, Any]:
    """Return `tables` with what the kind of plant says where the file is silent."""
    filled, defaults = copy.copy(tables), kind.defaults
    filled["driver"] = _filled(tables.get("driver", {}), kind="inprocess")
    driver = filled["driver"]
    device = _heading_table(tables).get("model") if kind.free_signals else defaults.device
    if device is not None and isinstance(driver, dict) and driver.get("kind") == "inprocess":
        filled["driver"] = _filled(driver, device=device)
    filled["safety"] = _filled(tables.get("safety", {}), frozen_after=defaults.frozen_after)
    filled["estimator"] = _filled(tables.get("estimator", {}), kind=defaults.estimator)
    if defaults.controller is not None:
        filled["controller"] = _filled(tables.get("controller", {}), kind=defaults.controller)
    return filled


def _filled(table: Any, **defaults: Any) -> Any:
    return {**defaults, **table} if isinstance(table, dict) else table


def _scenario_of(kind: PlantKind, profile: DeviceProfile) -> type[Scenario]:
    """Return the scenario of a kind of device: its limits have the names and units of the device's channels."""
    limits = limits_table(profile, tuple(kind.defaults.limits.items()))
    optional = not any(field.is_required() for field in limits.model_fields.values())
    fields: dict[str, Any] = {
        "scenario": (ModelHeading if kind.free_signals else _heading_of(tuple(kind.units_from)), ...),
        "limits": (limits, Field(default_factory=limits) if optional else ...),
        "controller": (_controller_table(), None),
    }
    return create_model("Scenario", __base__=Scenario, **fields)


@lru_cache
def _heading_of(unit_keys: tuple[str, ...]) -> type[Heading]:
    """Return the table with the keys that set units."""
    if not unit_keys:
        return Heading
    fields: dict[str, Any] = {
        key: (Annotated[str, AfterValidator(known_unit)] | None, None) for key in unit_keys
    }
    return create_model("Heading", __base__=Heading, **fields)


@lru_cache
def _controller_table() -> Any:
    """Return the union of the program's controllers' tables and the user's."""
    ours = {entry.name: load(entry) for entry in entries("controller") if not entry.is_own}
    union: Any = Annotated[OwnController, Tag(OwnPart.union_tag)]
    for name, table in ours.items():
        union = union | Annotated[table, Tag(name)]
    return Annotated[union, chosen_by_kind(*ours)] | None


def _apply(tables: dict[str, Any], override: str) -> None:
    key, equals, text = override.partition("=")
    parts = key.strip().split(".")
    if not equals or not all(parts):
        raise InputError(f"--set {override}: expected KEY=VALUE, such as --set driver.kind=modbus-tcp")
    table: Any = tables
    for part in parts[:-1]:
        table = _inner(table, part, override)
    if not isinstance(table, dict):
        raise InputError(f'--set {override}: "{parts[-2]}" is not a table')
    value = _value(text)
    if parts[-1] == "kind" and table.get("kind") != value:
        table.clear()  # another kind has other keys: those of the old one would be unknown to it
    table[parts[-1]] = value


def _inner(table: Any, part: str, override: str) -> Any:
    """Return the table below `part`; a list of tables is indexed from 0: `excitation.0.seed=7`."""
    if isinstance(table, list) and part.isdigit() and int(part) < len(table):
        return table[int(part)]
    if isinstance(table, dict):
        return table.setdefault(part, {})
    raise InputError(f'--set {override}: there is no table "{part}" here')


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text  # a bare word or "1 ms" without quotes, as a shell hands it over
