"""A scenario file: everything about a run that a person decides, checked before anything moves.

[scenario] [driver] [clock] [limits]  and either  [reference] [estimator] [controller]  or  [[excitation]]
"""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from rtctl.border.errors import InputError
from rtctl.border.quantities import Checked, Quantity, check, read_toml
from rtctl.signals.excitations import Excitation
from rtctl.signals.levels import Level, LevelIn
from rtctl.signals.references import Reference

Seconds = Annotated[float, Quantity("s"), Field(allow_inf_nan=False)]
MilliAmps = Annotated[float, Quantity("mA"), Field(allow_inf_nan=False)]
_ADDRESS = re.compile(r"(?!\.|[^:]*\.\.)[\w.-]{1,253}:\d{1,5}|\[[0-9a-fA-F:]+\]:\d{1,5}", re.ASCII)


class Heading(Checked):
    """[scenario]"""

    title: str
    plant: Literal["vo2"] = "vo2"
    any_device: bool = False
    """Run although the model was identified on a device of another identity."""
    period_s: Annotated[Seconds, Field(alias="period", gt=0.0)] = 1e-3
    duration_s: Annotated[Seconds | None, Field(alias="duration", gt=0.0)] = None

    @model_validator(mode="after")
    def _whole_steps(self) -> Heading:
        period_us = 1e6 * self.period_s
        if not (round(period_us) >= 1 and math.isclose(period_us, round(period_us), rel_tol=1e-9)):
            raise ValueError(
                f"period = {period_us:.10g} us must be whole microseconds: a device counts in them"
            )
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


class ModbusRtu(Checked):
    """[driver] kind = "modbus-rtu"."""

    kind: Literal["modbus-rtu"] = "modbus-rtu"
    port: str
    baud: Annotated[int, Field(gt=0)] = 115200
    unit: Annotated[int, Field(ge=1, le=247)] = 1


class ModbusTcp(Checked):
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


DriverTable = Annotated[InProcess | ModbusRtu | ModbusTcp, Field(discriminator="kind")]


class ClockTable(Checked):
    """[clock]"""

    mode: Literal["lockstep", "live"] = "lockstep"
    settle_s: Annotated[Seconds, Field(alias="settle", ge=0.0)] = 0.05
    """Full cooling at the safe level before the first sample."""
    timeout_s: Annotated[Seconds | None, Field(alias="timeout", gt=0.0)] = None
    """For one exchange; default: five periods, at least 50 ms (lockstep: 1 s)."""
    watchdog_s: Annotated[Seconds | None, Field(alias="watchdog", ge=0.0)] = None
    """The device's own; default: ten periods, at least 100 ms (lockstep: none)."""

    @model_validator(mode="after")
    def _representable(self) -> ClockTable:
        watchdog_ms = 1e3 * (self.watchdog_s or 0.0)
        if not (watchdog_ms == 0.0 or 1.0 <= watchdog_ms <= 0xFFFF):
            raise ValueError(f"watchdog = {watchdog_ms:g} ms must be 0 (none) or 1 to 65535 ms")
        return self


class LimitsTable(Checked):
    """[limits] of the command, and what the loop believes of a reading."""

    low: Annotated[MilliAmps, Field(ge=0.0)] = 3.68
    high: MilliAmps = 8.49
    safe: Annotated[MilliAmps, Field(ge=0.0)] | None = None
    """Where every end of a run leaves the device; default: `low`."""
    slew_mA_per_s: Annotated[float, Quantity("mA/s"), Field(alias="slew", gt=0.0)] = float("inf")
    sensed_low: Annotated[float, Quantity("ohm")] = 100.0
    sensed_high: Annotated[float, Quantity("ohm")] = 10.0e6

    @model_validator(mode="after")
    def _ordered(self) -> LimitsTable:
        if not self.low < self.high:
            raise ValueError(f"low = {self.low:g} mA must be below high = {self.high:g} mA")
        safe = self.low if self.safe is None else self.safe
        if safe > self.high:
            raise ValueError(f"safe = {safe:g} mA must not exceed high = {self.high:g} mA")
        if not self.sensed_low < self.sensed_high:
            raise ValueError(
                f"sensed_low = {self.sensed_low:g} ohm must be below sensed_high = {self.sensed_high:g} ohm"
            )
        return self


class EstimatorTable(Checked):
    """[estimator]: one line exchanges it."""

    kind: Literal["composite", "gap_free", "preisach", "egpi", "observer"] = "observer"


class ControllerTable(Checked):
    """[controller]: gains from the model with these margins, or by hand."""

    kind: Literal["pi"] = "pi"
    gain_margin: Annotated[float, Field(gt=1.0)] = 2.0
    phase_margin_rad: Annotated[float, Quantity("rad"), Field(alias="phase_margin", gt=0.0)] = (
        1.0471975511965976
    )
    kp: Annotated[float, Quantity("mA/um"), Field(ge=0.0, allow_inf_nan=False)] | None = None
    ki: Annotated[float, Quantity("mA/(um*s)"), Field(gt=0.0, allow_inf_nan=False)] | None = None
    feedforward: Literal["none", "inverse"] = "none"
    """inverse: the identified model's own current for the next setpoint, the PI corrects what it gets wrong."""
    deadband: Annotated[Level, LevelIn("um")] = Level(0.15, True)
    """Errors below this move nothing: inside the hysteresis the plant's gain is negative, and a PI would hunt."""

    @model_validator(mode="after")
    def _sound(self) -> ControllerTable:
        if (self.kp is None) != (self.ki is None):
            raise ValueError("kp and ki are set together, or neither (then the model's tuning applies)")
        if self.deadband.value < 0.0:
            raise ValueError(f"deadband = {self.deadband.value:g} must be >= 0")
        return self


class ChecksTable(Checked):
    """[checks]: upper bounds in percent of the deflection range; a run that misses one exits with 1."""

    tracking_mean_percent: Annotated[float, Field(gt=0.0)] | None = None
    tracking_max_percent: Annotated[float, Field(gt=0.0)] | None = None
    self_sensing_mean_percent: Annotated[float, Field(gt=0.0)] | None = None
    self_sensing_max_percent: Annotated[float, Field(gt=0.0)] | None = None


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
    limits: LimitsTable = LimitsTable()
    reference: Reference | None = None
    excitation: tuple[Excitation, ...] = ()
    estimator: EstimatorTable = EstimatorTable()
    controller: ControllerTable = ControllerTable()
    checks: ChecksTable = ChecksTable()
    paper: PaperTable = PaperTable()

    @model_validator(mode="after")
    def _one_purpose(self) -> Scenario:
        if (self.reference is None) == (not self.excitation):
            raise ValueError("a scenario has either a [reference] to track or [[excitation]] tables to play")
        if self.reference is not None and self.scenario.duration_s is None:
            raise ValueError('key "scenario.duration" is missing: a [reference] does not end by itself')
        return self


def load_scenario(path: Path, overrides: list[str]) -> tuple[Scenario, dict[str, Any]]:
    """The checked scenario and its tables after `--set KEY=VALUE` overrides. Raises InputError."""
    tables = read_toml(path)
    for override in sorted(overrides, key=lambda text: not text.partition("=")[0].endswith(".kind")):
        _apply(tables, override)  # kinds first: another kind empties its table
    if isinstance(driver := tables.setdefault("driver", {}), dict):
        driver.setdefault("kind", "inprocess")
    return check(Scenario, tables, str(path)), tables


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
