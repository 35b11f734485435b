"""What the tables of drivers with a wire share: where it leads, and faults that are injected into it."""

from __future__ import annotations

import re
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from rtctl.border.units.quantities import Checked
from rtctl.scenario.clock import Seconds

LARGEST_PORT = 0xFFFF
_ADDRESS = re.compile(r"(?!\.|[^:]*\.\.)[\w.-]{1,253}:\d{1,5}|\[[0-9a-fA-F:]+\]:\d{1,5}", re.ASCII)


def _host_and_port(address: str) -> str:
    if not _ADDRESS.fullmatch(address):
        raise ValueError(f"an address is HOST:PORT, such as 127.0.0.1:5020, got {address!r}")
    port = int(address.rpartition(":")[2])
    if port > LARGEST_PORT:
        raise ValueError(f"port {port} of {address!r} is above {LARGEST_PORT}, the largest that there is")
    return address


Address = Annotated[str, AfterValidator(_host_and_port)]
"""HOST:PORT."""


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

    @property
    def place_key(self) -> str:
        """The key that says where the wire leads: "address" of a network, "port" of a serial line."""
        return "address" if getattr(self, "address", None) is not None else "port"
