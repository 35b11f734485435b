"""Faults from a scenario: the wire of the driver that the scenario names is struck, and the run says what it met."""

from __future__ import annotations

from pathlib import Path

import pytest
from peers import serving

from drivers.faulty import FaultyDriver
from plant_sim.catalogue import bundled_plant
from plant_sim.device import SimulatedDevice
from plant_sim.wire.serve import Wires
from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.cli import main
from rtctl.scenario.schema import load_scenario
from rtctl.wiring import build_driver, load_plant

SCENARIO = """
[scenario]
title = "a bad line"
[driver]
kind = "{kind}"
{key} = "{where}"
[[driver.faults]]
{fault}
[clock]
timeout = "300 ms"
[[excitation]]
kind = "levels"
hold = "100 ms"
levels = ["20 %", "80 %"]
"""


def scenario_file(folder: Path, kind: str, where: str, fault: str) -> Path:
    file, key = folder / "scenario.toml", "address" if kind == "modbus-tcp" else "port"
    file.write_text(SCENARIO.format(kind=kind, key=key, where=where, fault=fault), encoding="utf-8")
    return file


@pytest.mark.wire
@pytest.mark.parametrize("kind", ["serial", pytest.param("modbus-tcp", marks=pytest.mark.slow)])
def test_a_scenario_with_faults_ends_with_a_name_and_repeats_by_its_seed(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    device = SimulatedDevice(load_plant(bundled_plant("vo2_a"), seed=5))
    wires = Wires(tcp="127.0.0.1:0") if kind == "modbus-tcp" else Wires(serial_path=tmp_path / "port")
    with serving(device, wires) as ends:
        fault = 'kind = "drop"\nrate = 0.05\nway = "to_host"'
        file = scenario_file(tmp_path, kind, ends.split()[1], fault)
        assert main(["acquire", str(file), "--out", str(tmp_path / "data"), "--quiet"]) == 1
        assert "no_answer" in capsys.readouterr().err
        scenario, _ = load_scenario(file, ["driver.faults_seed=11"])
        counts, faults = [], []
        for _ in range(2):
            driver = build_driver(scenario, tmp_path)
            assert isinstance(driver, FaultyDriver)
            done = 0
            try:
                driver.open(lockstep_period_us=1000, watchdog_ms=0, timeout_s=2.0)
                for _ in range(200):
                    driver.exchange((5.0,))
                    done += 1
            except DriverError as error:
                faults.append(error.fault)
            driver.close((0.0,))
            assert driver.injected["drop"] >= 1
            counts.append(done)
        assert counts[0] == counts[1]
        assert faults == [Fault.NO_ANSWER, Fault.NO_ANSWER]


def test_faults_that_cannot_be_are_bad_input(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="rate"):
        load_scenario(scenario_file(tmp_path, "serial", "x", 'kind = "drop"\nrate = 2'), [])
    with pytest.raises(InputError, match="drop"):
        load_scenario(scenario_file(tmp_path, "serial", "x", 'kind = "dropp"\nrate = 0.1'), [])
    scenario, _ = load_scenario(
        scenario_file(tmp_path, "serial", "x", 'kind = "device_reboot"\nrate = 0.1'), []
    )
    with pytest.raises(InputError, match="device_reboot needs the process"):
        build_driver(scenario, tmp_path)
