"""[driver] of a scenario: which device is driven, and over which wire."""

from __future__ import annotations

import re
from typing import Annotated, Literal

from pydantic import Field, Tag, field_validator

from rtctl.border.quantities import Checked
from rtctl.scenario.clock import Seconds
from rtctl.scenario.own_parts import OwnDriver, chosen_by_kind

_ADDRESS = re.compile(r"(?!\.|[^:]*\.\.)[\w.-]{1,253}:\d{1,5}|\[[0-9a-fA-F:]+\]:\d{1,5}", re.ASCII)


class InProcess(Checked):
    """[driver] kind = "inprocess": a simulated device in this process."""

    kind: Literal["inprocess"] = "inprocess"
    device: str
    """Plant file, name of a bundled one, name of a registered kind of plant, or "module:Class"; the scenario's kind of
    plant may have a default."""
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
    """Process id of `rtctl serve`, for device_reboot."""


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


DriverTable = Annotated[
    Annotated[InProcess, Tag("inprocess")]
    | Annotated[ModbusRtu, Tag("modbus-rtu")]
    | Annotated[ModbusTcp, Tag("modbus-tcp")]
    | Annotated[Serial, Tag("serial")]
    | Annotated[OwnDriver, Tag("own")],
    chosen_by_kind("inprocess", "modbus-rtu", "modbus-tcp", "serial"),
]
