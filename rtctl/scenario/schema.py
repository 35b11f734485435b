"""A scenario file: everything about a run that a person decides, checked before anything moves.

Tables: `scenario`, `driver`, `clock`, `limits`, `safety`, and either `reference`, `estimator`, `controller`, or
`excitation` (one table each).
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, create_model, field_validator, model_validator

from rtctl.border.errors import InputError, nearest
from rtctl.border.quantities import Checked, Quantity, check, convert, read_toml
from rtctl.border.records import OSCILLATOR, PROFILES, VO2, DeviceProfile, oscillator_profile
from rtctl.scenario.clock import ClockTable, Seconds
from rtctl.scenario.limits import LimitsTable, limits_table
from rtctl.scenario.safety import SafetyTable
from rtctl.signals.excitations import Excitation
from rtctl.signals.levels import Level, LevelOf, whole_microseconds
from rtctl.signals.references import Reference

_ADDRESS = re.compile(r"(?!\.|[^:]*\.\.)[\w.-]{1,253}:\d{1,5}|\[[0-9a-fA-F:]+\]:\d{1,5}", re.ASCII)


class Heading(Checked):
    """[scenario]"""

    title: str
    plant: str = "vo2"
    drive_unit: str | None = None
    """Of an oscillator: the unit of the numbers that its command carries."""
    displacement_unit: str | None = None
    """Likewise of its reading."""
    model: str | None = None
    """Model file beside the scenario that applies where `--model` is not given."""
    any_device: bool = False
    """Run although the model was identified on a device of another identity."""
    period_s: Annotated[Seconds, Field(alias="period", gt=0.0)] = 1e-3
    duration_s: Annotated[Seconds | None, Field(alias="duration", gt=0.0)] = None

    @field_validator("plant")
    @classmethod
    def _known_plant(cls, plant: str) -> str:
        if plant not in PROFILES:
            raise ValueError(f'unknown plant "{plant}"{nearest(plant, PROFILES)}')
        return plant

    @field_validator("drive_unit", "displacement_unit")
    @classmethod
    def _known_unit(cls, unit: str | None) -> str | None:
        if unit is not None:
            convert(1.0, unit, unit)
        return unit

    @model_validator(mode="after")
    def _units_of_an_oscillator(self) -> Heading:
        given = [self.drive_unit is not None, self.displacement_unit is not None]
        if self.plant == OSCILLATOR.kind and not all(given):
            raise ValueError(
                'an "oscillator" needs drive_unit and displacement_unit, such as "m/s^2" and "mm": what the numbers on '
                "its wire are in"
            )
        if self.plant != OSCILLATOR.kind and any(given):
            raise ValueError(
                f'drive_unit and displacement_unit are of an "oscillator", not of a "{self.plant}"'
            )
        return self

    @property
    def profile(self) -> DeviceProfile:
        """Of the device that the scenario drives."""
        return profile_of(self.plant, self.drive_unit, self.displacement_unit)

    @model_validator(mode="after")
    def _whole_steps(self) -> Heading:
        whole_microseconds(self.period_s)
        if self.duration_s is not None and round(self.duration_s / self.period_s) < 1:
            raise ValueError(
                f"duration = {self.duration_s:g} s is shorter than the period {self.period_s:g} s"
            )
        return self


class InProcess(Checked):
    """[driver] kind = "inprocess": a simulated device in this process."""

    kind: Literal["inprocess"] = "inprocess"
    device: str = "vo2_a"
    """Plant file, or the name of a bundled one."""
    seed: Annotated[int, Field(ge=0)] | None = None


class FaultTable(Checked):
    """[[driver.faults]]: what is done to the wire on purpose."""

    kind: Literal[
        "delay", "jitter", "drop", "duplicate", "reorder", "bit_flip", "truncate", "stall", "disconnect",
        "device_reboot", "host_pause",
    ]  # fmt: skip
    rate: Annotated[float, Field(ge=0.0, le=1.0)]
    """Share of the bursts of bytes that it strikes."""
    duration_s: Annotated[Seconds, Field(alias="duration", ge=0.0, le=60.0)] = 0.0
    way: Literal["to_device", "to_host"] | None = None
    """Both, unless given."""


class Wire(Checked):
    """Keys of every driver with a wire."""

    faults: tuple[FaultTable, ...] = ()
    faults_seed: Annotated[int, Field(ge=0)] = 0
    device_pid: Annotated[int, Field(gt=0)] | None = None
    """Of `rtctl serve`, for device_reboot."""


class ModbusRtu(Wire):
    """[driver] kind = "modbus-rtu"."""

    kind: Literal["modbus-rtu"] = "modbus-rtu"
    port: str
    baud: Annotated[int, Field(gt=0)] = 115200
    unit: Annotated[int, Field(ge=1, le=247)] = 1


class ModbusTcp(Wire):
    """[driver] kind = "modbus-tcp"."""

    kind: Literal["modbus-tcp"] = "modbus-tcp"
    address: str
    """HOST:PORT."""
    unit: Annotated[int, Field(ge=0, le=247)] = 1

    @field_validator("address")
    @classmethod
    def _host_and_port(cls, address: str) -> str:
        if not _ADDRESS.fullmatch(address) or int(address.rpartition(":")[2]) > 0xFFFF:
            raise ValueError(f"an address is HOST:PORT, such as 127.0.0.1:5020, got {address!r}")
        return address


class Serial(Wire):
    """[driver] kind = "serial": the plain serial protocol (docs/serial-protocol.md)."""

    kind: Literal["serial"] = "serial"
    port: str
    baud: Annotated[int, Field(gt=0)] = 115200
    pipeline: Annotated[int, Field(ge=0, le=16)] = 0
    """How many answers may be under way when a command is sent, in live runs: for a wire slower than the period."""


DriverTable = Annotated[InProcess | ModbusRtu | ModbusTcp | Serial, Field(discriminator="kind")]


class EstimatorTable(Checked):
    """[estimator]: one line exchanges it."""

    kind: Literal["composite", "gap_free", "preisach", "egpi", "observer", "lock_in"] = "observer"


class PiTable(Checked):
    """[controller] kind = "pi": gains from the model with these margins, or by hand."""

    kind: Literal["pi"] = "pi"
    gain_margin: Annotated[float, Field(gt=1.0)] = 2.0
    phase_margin_rad: Annotated[float, Quantity("rad"), Field(alias="phase_margin", gt=0.0)] = (
        1.0471975511965976
    )
    kp: Annotated[float, Quantity("mA/um"), Field(ge=0.0, allow_inf_nan=False)] | None = None
    ki: Annotated[float, Quantity("mA/(um*s)"), Field(gt=0.0, allow_inf_nan=False)] | None = None
    feedforward: Literal["none", "inverse"] = "none"
    """inverse: the identified model's own current for the next setpoint, the PI corrects what it gets wrong."""
    deadband: Annotated[Level, LevelOf("output")] = Level(0.15, True)
    """Errors below this move nothing: inside the hysteresis the plant's gain is negative, and a PI would hunt."""

    @model_validator(mode="after")
    def _sound(self) -> PiTable:
        if (self.kp is None) != (self.ki is None):
            raise ValueError("kp and ki are set together, or neither (then the model's tuning applies)")
        if self.deadband.value < 0.0:
            raise ValueError(f"deadband = {self.deadband.value:g} must be >= 0")
        return self


class AgcPllTable(Checked):
    """[controller] kind = "agc_pll": amplitude by the coil's current, phase by the frequency; gains from the model."""

    kind: Literal["agc_pll"] = "agc_pll"
    phase_deg: Annotated[float, Quantity("deg"), Field(alias="phase", ge=-180.0, le=180.0)] = -90.0
    """Setpoint of the displacement's phase against the coil current."""
    gate: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] = 20.0
    """Least response in standard errors of the estimate: below, the PLL holds and the AGC gives no more than a kick."""
    kick: Annotated[float, Field(gt=0.0, le=1.0)] = 0.5
    """Share of the current that holds the setpoint."""
    separation: Annotated[float, Field(ge=1.0, allow_inf_nan=False)] = 5.0
    """How many times slower the amplitude loop is."""
    pll_bandwidth_hz: Annotated[float | None, Quantity("Hz"), Field(alias="pll_bandwidth", gt=0.0)] = None
    agc_bandwidth_hz: Annotated[float | None, Quantity("Hz"), Field(alias="agc_bandwidth", gt=0.0)] = None


ControllerTable = Annotated[PiTable | AgcPllTable, Field(discriminator="kind")]


class ChecksTable(Checked):
    """[checks]: upper bounds, in percent of the output's range or as their names say; missing one is exit 1."""

    tracking_mean_percent: Annotated[float, Field(gt=0.0)] | None = None
    tracking_max_percent: Annotated[float, Field(gt=0.0)] | None = None
    self_sensing_mean_percent: Annotated[float, Field(gt=0.0)] | None = None
    self_sensing_max_percent: Annotated[float, Field(gt=0.0)] | None = None
    settle_after_s: Annotated[Seconds | None, Field(alias="settle_after", ge=0.0)] = None
    """No bound: how long after a new setpoint its level counts as settled."""
    hold_max_percent: Annotated[float, Field(gt=0.0)] | None = None
    """Of the setpoint: how far the settled output may be from it at any sample."""
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
    driver: DriverTable = InProcess()
    clock: ClockTable = ClockTable()
    limits: LimitsTable
    safety: SafetyTable = SafetyTable()
    reference: Reference | None = None
    excitation: tuple[Excitation, ...] = ()
    estimator: EstimatorTable = EstimatorTable()
    controller: ControllerTable = PiTable()
    checks: ChecksTable = ChecksTable()
    paper: PaperTable = PaperTable()

    @field_validator("controller", mode="before")
    @classmethod
    def _kind_of_controller(cls, table: Any) -> Any:
        return {"kind": "pi", **table} if isinstance(table, dict) else table

    @property
    def profile(self) -> DeviceProfile:
        """Of the device that the scenario drives."""
        return self.scenario.profile

    @model_validator(mode="after")
    def _one_purpose(self) -> Scenario:
        if (self.reference is None) == (not self.excitation):
            raise ValueError("a scenario has either a [reference] to track or [[excitation]] tables to play")
        if self.reference is not None and self.scenario.duration_s is None:
            raise ValueError('key "scenario.duration" is missing: a [reference] does not end by itself')
        return self

    @model_validator(mode="after")
    def _pipelined_live(self) -> Scenario:
        if isinstance(self.driver, Serial) and self.driver.pipeline and self.clock.mode == "lockstep":
            raise ValueError(
                f"driver.pipeline = {self.driver.pipeline} needs clock.mode = live: in lockstep the device waits for "
                "each command, and a slow wire costs no delay"
            )
        return self

    def at_period_of(self, record: int) -> Scenario:
        """The same at the period of an excitation that has one of its own."""
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
    """The checked scenario and its tables after `--set KEY=VALUE` overrides. Raises InputError."""
    tables = overridden(read_toml(path), overrides)
    if isinstance(driver := tables.setdefault("driver", {}), dict):
        driver.setdefault("kind", "inprocess")
    return checked_scenario(tables, str(path)), tables


def overridden(tables: dict[str, Any], overrides: list[str]) -> dict[str, Any]:
    """`tables` with `KEY=VALUE` overrides applied in place. Raises InputError."""
    for override in sorted(overrides, key=lambda text: not text.partition("=")[0].endswith(".kind")):
        _apply(tables, override)  # kinds first: another kind empties its table
    return tables


def checked_scenario(tables: dict[str, Any], source: str) -> Scenario:
    """The scenario that `tables` are, of the file or recording `source`. Raises InputError."""
    profile = _profile_of(tables)
    return check(scenario_of(profile), tables, source, context={"profile": profile})


def scenario_of(profile: DeviceProfile) -> type[Scenario]:
    """The scenario of a kind of device: its limits have the names and units of the device's channels."""
    table = limits_table(profile)
    optional = not any(field.is_required() for field in table.model_fields.values())
    limits: Any = (table, Field(default_factory=table) if optional else ...)
    return create_model("Scenario", __base__=Scenario, limits=limits)


def _profile_of(tables: dict[str, Any]) -> DeviceProfile:
    """By `scenario.plant`; of an unknown one, which is a finding of its own, the default's."""
    heading = tables.get("scenario")
    report = heading if isinstance(heading, dict) else {}
    plant, units = (
        str(report.get("plant", VO2.kind)),
        (report.get("drive_unit"), report.get("displacement_unit")),
    )
    if plant not in PROFILES or not all(unit is None or isinstance(unit, str) for unit in units):
        return VO2
    return profile_of(plant, *units)


def profile_of(plant: str, drive_unit: str | None, displacement_unit: str | None) -> DeviceProfile:
    """Of a known kind of plant; an oscillator's is in the given units."""
    if plant == OSCILLATOR.kind and drive_unit and displacement_unit:
        return oscillator_profile(drive_unit=drive_unit, displacement_unit=displacement_unit)
    return PROFILES[plant]


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
    """The table below `part`; a list of tables is indexed from 0: `excitation.0.seed=7`."""
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
