"""A second client that commands the device of a run."""

from __future__ import annotations

import json
import struct
import threading
import time
from pathlib import Path

import pytest
from peers import serving
from pymodbus.client import ModbusTcpClient

from plant_sim.catalogue import bundled_plant
from plant_sim.device import SimulatedDevice
from plant_sim.wire.serve import Wires
from rtctl.cli import main
from rtctl.wiring import load_plant


def command_once(port: int, level_mA: float) -> None:
    """Wait until the device of a run is commanded, then write a command with a number of our own."""
    with ModbusTcpClient("127.0.0.1", port=port) as client:
        client.connect()
        until = time.monotonic() + 20.0
        while time.monotonic() < until:
            number = client.read_holding_registers(0, count=6).registers[2]
            if number:
                words = struct.unpack(">HH", struct.pack(">f", level_mA))
                client.write_registers(0, [*words, (number + 1000) % 65536])
                return


@pytest.mark.wire
def test_in_lockstep_a_second_client_ends_the_run_named_and_at_the_safe_level(
    model_file: Path, tmp_path: Path
) -> None:
    device = SimulatedDevice(load_plant(bundled_plant("vo2_a"), seed=5))
    with serving(device, Wires(tcp="127.0.0.1:0")) as ends:
        address = ends.split()[1]
        other = threading.Thread(target=command_once, args=(int(address.split(":")[1]), 8.0))
        other.start()
        there = ["--set", "driver.kind=modbus-tcp", "--set", f"driver.address={address}"]
        run = ["run", "steps", "--model", str(model_file), "--out", str(tmp_path), "--quiet", "--no-plot"]
        assert main([*run, *there, "--set", "scenario.duration=20 s"]) == 1
        other.join(20.0)
    (fault,) = json.loads((tmp_path / "summary.json").read_text())["faults"]
    assert fault["fault"] == "device_time"
    assert not device.enabled
