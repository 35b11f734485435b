"""Where a device is served, and what goes wrong: `rtctl serve --faults FILE|SPEC`, a TOML file or a short text.

    drop rate=0.01; delay rate=0.05 duration=20ms way=to_host; sensor_fault at=5s duration=200ms

A fault of the line strikes a share of the bursts of bytes (`rate`) or once at a time (`at`, after the first command); a
fault of the device strikes at a time. A file has the same as tables [[faults]], and `seed` of the line's chance.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, model_validator

from rtctl.border.errors import InputError
from rtctl.border.units.quantities import Checked, check, read_toml
from rtctl.scenario.clock import Seconds

OF_DEVICE = ("frozen_value", "sensor_fault", "frozen_counter", "watchdog_tripped", "not_enabled")
"""Faults of the device, by the names under which `rtctl run` reports them."""
LASTING = ("delay", "jitter", "reorder", "stall", "disconnect", *OF_DEVICE[:3])
"""Faults that need a duration."""
OF_PORTS = ("bit_flip", "truncate")
SUFFIX = ".toml"
OPTION = "--faults"


class ServedAt(NamedTuple):
    """Wires of a served device."""

    rtu_path: Path | None = None
    serial_path: Path | None = None
    tcp: str | None = None
    """HOST:PORT."""
    scpi: str | None = None
    """HOST:PORT or path of a source meter in front of the device."""
    instrument: str = "keithley-2450"
    voltmeter: str | None = None
    """The same of a voltmeter at its external instrument."""
    baud: int | None = None
    journal: Path | None = None
    """File of what the device did."""

    def wires(self) -> dict[str, Any]:
        """Return the wires alone, by name."""
        return {name: value for name, value in self._asdict().items() if name != "journal"}


class ServedFault(Checked):
    """One fault."""

    kind: Literal[
        "delay", "jitter", "drop", "duplicate", "reorder", "bit_flip", "truncate", "stall", "disconnect",
        "device_reboot", "frozen_value", "sensor_fault", "frozen_counter", "watchdog_tripped", "not_enabled",
    ]  # fmt: skip
    rate: Annotated[float | None, Field(gt=0.0, le=1.0)] = None
    """Share of the bursts of bytes that it strikes."""
    at_s: Annotated[Seconds | None, Field(alias="at", ge=0.0)] = None
    """Time after the first command."""
    duration_s: Annotated[Seconds, Field(alias="duration", ge=0.0, le=60.0)] = 0.0
    way: Literal["to_device", "to_host"] | None = None
    """Both, unless given."""

    @model_validator(mode="after")
    def _complete(self) -> ServedFault:
        if self.kind in OF_DEVICE and self.at_s is None:
            raise ValueError(f"{self.kind} is a fault of the device: give at, such as at=5s")
        if (self.rate is None) == (self.at_s is None):
            raise ValueError(
                f"{self.kind} needs either rate, a share of the bursts of bytes, or at, a time, such as at=5s"
            )
        if self.kind in LASTING and self.duration_s == 0.0:
            raise ValueError(f"{self.kind} needs a duration, such as duration=20ms")
        if self.at_s is not None and self.way is not None:
            raise ValueError(
                f"{self.kind} at a time strikes the next bytes in either direction: leave way out"
            )
        return self


class ServedFaults(Checked):
    """All faults of a served device."""

    faults: tuple[ServedFault, ...] = ()
    seed: Annotated[int, Field(ge=0)] = 0


def read_faults(text: str, *, on_tcp: bool) -> ServedFaults:
    """Return the faults of a file or a short text.

    Args:
        text: As it stands behind --faults.
        on_tcp: Whether the device is served on a network.

    Raises:
        InputError: a fault is wrong, or none of this kind of line.
    """
    is_file = text.endswith(SUFFIX)
    tables = (
        read_toml(Path(text))
        if is_file
        else {"faults": [_table(one) for one in text.split(";") if one.strip()]}
    )
    found = check(ServedFaults, tables, text if is_file else OPTION)
    wrong = [one.kind for one in found.faults if on_tcp and one.kind in OF_PORTS]
    if wrong:
        raise InputError(
            f"{OPTION}: {wrong[0]} is none of a TCP connection: its checksum turns damage into delay; use delay"
        )
    if not found.faults:
        raise InputError(
            f'{OPTION} "{text}": no fault is in it; write it like "drop rate=0.01; stall at=5s duration=1s"'
        )
    return found


def _table(text: str) -> dict[str, Any]:
    """Return `KIND KEY=VALUE ...` as a table. Raises InputError."""
    kind, *pairs = text.split()
    table: dict[str, Any] = {"kind": kind}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not equals or not value or key in table:
            raise InputError(
                f'{OPTION} "{text.strip()}": "{pair}" is no KEY=VALUE; write it like "stall at=5s duration=1s", '
                "without a space before a unit"
            )
        table[key] = value
    return table
