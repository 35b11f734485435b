"""[limits] of a scenario: bounds of each command and of each reading, in the units of the device's profile.

The keys of the table itself are those of the first command (`low`, `high`, `safe`, `slew`) and of the first reading
(`sensed_low`, `sensed_high`). Further commands and readings have tables of their own name:
`[limits.drive_frequency]`, `[limits.quadrature]`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Any, ClassVar, NamedTuple

from pydantic import Field, create_model, model_validator

from rtctl.border.records import Channel, DeviceProfile
from rtctl.border.units.quantities import Checked, Quantity
from rtctl.safety.limits import CommandLimits

REQUIRED: Any = ...


class Range(NamedTuple):
    """Range in which a reading is believed."""

    low: float
    high: float
    rate_per_s: float = float("inf")


class ChannelLimits(Checked):
    """Bounds of one command, in its unit."""

    unit: ClassVar[str] = ""
    low: float
    high: float
    safe: float | None = None
    """Where every end of a run leaves the device; default: `low`."""
    slew_per_s: float = float("inf")
    rms: float = float("inf")
    """Largest root mean square over `rms_window`."""
    rms_window_s: Annotated[float, Quantity("s"), Field(alias="rms_window", gt=0.0, allow_inf_nan=False)] = (
        1.0
    )
    stop: bool = False
    """A controller that asks for more than bounds and slew allow ends the run."""

    @property
    def safe_level(self) -> float:
        """`safe`, or what it is by default."""
        return self.low if self.safe is None else self.safe

    def command_limits(self) -> CommandLimits:
        """As the loop holds them."""
        return CommandLimits(
            low=self.low,
            high=self.high,
            safe=self.safe_level,
            slew_per_s=self.slew_per_s,
            rms=self.rms,
            rms_window_s=self.rms_window_s,
            stop=self.stop,
        )

    @model_validator(mode="after")
    def _ordered(self) -> ChannelLimits:
        if not self.low < self.high:
            raise ValueError(f"low = {self.low:g} {self.unit} must be below high = {self.high:g} {self.unit}")
        if self.safe_level > self.high:
            raise ValueError(
                f"safe = {self.safe_level:g} {self.unit} must not exceed high = {self.high:g} {self.unit}"
            )
        if not self.rms > abs(self.safe_level):
            raise ValueError(
                f"rms = {self.rms:g} {self.unit} must exceed safe = {self.safe_level:g} {self.unit}, which is held for "
                "long"
            )
        return self


class ReadingLimits(Checked):
    """What is believed of one reading, in its unit."""

    low: float
    high: float
    rate_per_s: float = float("inf")


class LimitsTable(ChannelLimits):
    """The whole table; `limits_table` makes the one of a profile."""

    sensed_unit: ClassVar[str] = ""
    sensed_low: float = float("-inf")
    sensed_high: float = float("inf")
    sensed_rate_per_s: float = float("inf")
    """Largest change of the first reading a second."""

    @model_validator(mode="after")
    def _believable(self) -> LimitsTable:
        if not self.sensed_low < self.sensed_high:
            raise ValueError(
                f"sensed_low = {self.sensed_low:g} {self.sensed_unit} must be below sensed_high = "
                f"{self.sensed_high:g} {self.sensed_unit}"
            )
        return self

    def commands(self, profile: DeviceProfile) -> tuple[ChannelLimits, ...]:
        """Return the limits of every command of the profile, in its order."""
        return (self, *(getattr(self, channel.name) for channel in profile.commands[1:]))

    def of_commands(self, profile: DeviceProfile) -> tuple[CommandLimits, ...]:
        """Return the limits of every command of the profile as the loop holds them, in its order."""
        return tuple(table.command_limits() for table in self.commands(profile))

    def readings(self, profile: DeviceProfile) -> tuple[Range, ...]:
        """Return the range of every reading, in order; one without a table takes the first's if it has its unit."""
        ranges = []
        for channel in profile.sensed:
            table: ReadingLimits | None = getattr(self, channel.name, None)
            if table is not None:
                ranges.append(Range(table.low, table.high, table.rate_per_s))
            elif channel.unit == profile.sensed[0].unit:
                ranges.append(Range(self.sensed_low, self.sensed_high, self.sensed_rate_per_s))
            else:
                ranges.append(Range(float("-inf"), float("inf")))
        return tuple(ranges)


@lru_cache
def limits_table(
    profile: DeviceProfile, default_items: tuple[tuple[str, float], ...] = ()
) -> type[LimitsTable]:
    """Return the table of a kind of device: units, names and default bounds of its channels."""
    first, *further = profile.commands
    sensed, *others = profile.sensed
    defaults = dict(default_items)
    fields: dict[str, Any] = _command_fields(first, defaults)
    for name in ("sensed_low", "sensed_high"):
        default = defaults.get(name, LimitsTable.model_fields[name].default)
        fields[name] = (Annotated[float, Quantity(sensed.unit)], default)
    fields["sensed_rate_per_s"] = (_rate(sensed, "sensed_rate"), float("inf"))
    for channel in further:
        table = create_model(f"Limits_{channel.name}", __base__=ChannelLimits, **_command_fields(channel, {}))
        table.unit = channel.unit
        fields[channel.name] = (table, REQUIRED)
    for channel in others:
        bound: Any = (Annotated[float, Quantity(channel.unit)], REQUIRED)
        table_of = create_model(f"Limits_{channel.name}", __base__=ReadingLimits, low=bound, high=bound,
                                rate_per_s=(_rate(channel, "rate"), float("inf")))  # fmt: skip
        fields[channel.name] = (table_of | None, None)
    made = create_model(f"Limits_{profile.kind}", __base__=LimitsTable, **fields)
    made.unit, made.sensed_unit = first.unit, sensed.unit
    return made


def _command_fields(channel: Channel, defaults: dict[str, float]) -> dict[str, Any]:
    least: Any = Field(allow_inf_nan=False) if channel.signed else Field(ge=0.0, allow_inf_nan=False)
    level = Annotated[float, Quantity(channel.unit), least]
    highest = Annotated[float, Quantity(channel.unit), Field(allow_inf_nan=False)]
    rms = Annotated[float, Quantity(channel.unit), Field(gt=0.0)]
    return {
        "low": (level, defaults.get("low", REQUIRED)),
        "high": (highest, defaults.get("high", REQUIRED)),
        "safe": (level | None, None),
        "slew_per_s": (_rate(channel, "slew"), float("inf")),
        "rms": (rms, float("inf")),
    }


def _rate(channel: Channel, alias: str) -> Any:
    """Return the type of a change of the channel per second."""
    return Annotated[float, Quantity(f"{channel.unit}/s"), Field(alias=alias, gt=0.0)]
