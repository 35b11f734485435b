"""[driver] of a scenario: which device is driven, and over which wire."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, Tag

from rtctl.border.units.quantities import Checked
from rtctl.scenario.instruments import Scpi
from rtctl.scenario.own_parts import OwnDriver, chosen_by_kind
from rtctl.scenario.wires import Address, Wire


class InProcess(Checked):
    """[driver] kind = "inprocess": a simulated device in this process."""

    kind: Literal["inprocess"] = "inprocess"
    device: str
    """Plant file, name of a bundled one, name of a registered kind of plant, or "module:Class"; the scenario's kind of
    plant may have a default."""
    seed: Annotated[int, Field(ge=0)] | None = None


class ModbusRtu(Wire):
    """[driver] kind = "modbus-rtu"."""

    kind: Literal["modbus-rtu"] = "modbus-rtu"
    port: str
    baud: Annotated[int, Field(gt=0)] = 115200
    unit: Annotated[int, Field(ge=1, le=247)] = 1


class ModbusTcp(Wire):
    """[driver] kind = "modbus-tcp"."""

    kind: Literal["modbus-tcp"] = "modbus-tcp"
    address: Address
    unit: Annotated[int, Field(ge=0, le=247)] = 1


class Serial(Wire):
    """[driver] kind = "serial": the plain serial protocol (docs/serial-protocol.md)."""

    kind: Literal["serial"] = "serial"
    port: str
    baud: Annotated[int, Field(gt=0)] = 115200
    pipeline: Annotated[int, Field(ge=0, le=16)] = 0
    """How many answers may be under way when a command is sent, in live runs: for a wire slower than the period."""


DriverTable = Annotated[
    Annotated[InProcess, Tag("inprocess")]
    | Annotated[ModbusRtu, Tag("modbus-rtu")]
    | Annotated[ModbusTcp, Tag("modbus-tcp")]
    | Annotated[Serial, Tag("serial")]
    | Annotated[Scpi, Tag("scpi")]
    | Annotated[OwnDriver, Tag("own")],
    chosen_by_kind("inprocess", "modbus-rtu", "modbus-tcp", "serial", "scpi"),
]
