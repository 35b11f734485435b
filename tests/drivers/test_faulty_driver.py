"""Faults from a scenario: the wire of the driver that the scenario names is struck, and the run says what it met."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from peers import serving

from drivers.faulty import FaultyDriver
from plant_sim.catalogue import bundled_plant
from plant_sim.device import SimulatedDevice
from plant_sim.wire.serve import Wires
from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.cli import main
from rtctl.live_page.shown.event_log import EventLog
from rtctl.loop.events import Events, read_events
from rtctl.scenario.schema import load_scenario
from rtctl.session.live.injected_faults import InjectedFaults
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


@pytest.mark.wire
def test_injected_faults_are_events_of_a_run_and_a_replay_passes_over_them(
    tmp_path: Path, model_file: Path
) -> None:
    out = tmp_path / "run"
    device = SimulatedDevice(load_plant(bundled_plant("vo2_a"), seed=5))
    with serving(device, Wires(serial_path=tmp_path / "port")) as ends:
        late = 'kind = "delay"\nrate = 0.2\nduration = "1 ms"'
        file = scenario_file(tmp_path, "serial", ends.split()[1], late)
        assert main(["run", str(file), "--model", str(model_file), "--out", str(out), "--quiet"]) == 0
    events = list(read_events(out / "events.jsonl"))
    told = [one for one in events if one.kind == "injected"]
    assert told
    assert {one.values["fault"] for one in told} == {"delay"}
    assert 40 < sum(one.values["count"] for one in told) < 120, "a fifth of two bursts in each of 200 steps"
    assert told[0].step < 100, "it is noted when it strikes, not at the end"
    (text, *_) = [one["text"] for one in EventLog(out, None, 1e-3).look() or [] if one["kind"] == "injected"]
    assert text == "delay: 1 burst of bytes struck by chance"
    assert main(["replay", str(out), "--quiet"]) == 0


def test_later_faults_of_a_kind_are_noted_together_once_a_second() -> None:
    events, clock, rows = Events(), iter(np.arange(0.0, 100.0, 0.3)), iter(range(1000))
    faults = InjectedFaults(events, lambda: next(rows), lambda: next(clock))
    for _ in range(12):
        faults.struck("drop")
    faults.finish()
    counts = [one.values["count"] for one in events.noted]
    assert counts[0] == 1
    assert sum(counts) == 12
    assert 3 < len(counts) < 8
    assert events.noted[1].values["message"].endswith(f"struck by chance, {1 + counts[1]} so far")


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
