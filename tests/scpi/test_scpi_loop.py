"""A film that is slow enough for a source meter: measured, identified and controlled at 50 Hz, and off at every end."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from scpi_cases import SlowDevice, driver_at, in_thread, instrument_at
from wire_cases import settings, summary_of

from drivers.scpi.ports import serial_place
from plant_sim.catalogue import bundled_plant
from plant_sim.journal import read_journal
from plant_sim.wire.serve import Wires
from plant_sim.wire.serve import served as served_devices
from rtctl.cli import main

pytestmark = pytest.mark.wire

ACQUIRE = """
[scenario]
title = "film at a source meter"
period = "10 ms"
[clock]
mode = "live"
settle = "0.3 s"
timeout = "1 s"
watchdog = "2 s"
[[excitation]]
kind = "damped_oscillation"
use = "identify"
hold = "60 ms"
cycles = 4
step = "5 %"
centre = "66 %"
[[excitation]]
kind = "levels"
use = "fit"
hold = "0.1 s"
levels = ["0 %", "60 %", "30 %", "90 %", "50 %", "75 %"]
"""
LIVE = settings(
    "clock.mode=live",
    "scenario.period=20 ms",
    "clock.timeout=1 s",
    "clock.watchdog=2 s",
    "clock.settle=0.3 s",
)


@contextmanager
def served(folder: Path, wire: str) -> Iterator[list[str]]:
    """A film of 10 ms behind a source meter and a voltmeter, in a process of its own; `--set` options to it."""
    file = bundled_plant("vo2_slow").read_text(encoding="utf-8").replace('"60 ms"', '"10 ms"')
    (folder / "film.toml").write_text(file, encoding="utf-8")
    places = ["127.0.0.1:0"] * 2 if wire == "address" else [str(folder / "smu"), str(folder / "dmm")]
    command = [sys.executable, "-m", "rtctl", "serve", str(folder / "film.toml"), "--scpi", places[0],
               "--voltmeter", places[1], "--journal", str(folder / "journal.csv")]  # fmt: skip
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True) as process:
        try:
            assert process.stdout is not None
            words = process.stdout.readline().split()
            assert words[:2] == ["ready", "scpi"], words
            yield settings(
                "driver.kind=scpi", f"driver.{wire}={words[2]}", "driver.table=keithley-2450",
                "driver.compliance_voltage=20 V", "driver.nplc=0.1", f"driver.reference.{wire}={words[4]}",
                "driver.reference.scale=10 um/V", "driver.reference.nplc=0.1",
            )  # fmt: skip
        finally:
            process.send_signal(signal.SIGTERM)


def levels_in_force(folder: Path) -> list[float]:
    """The currents that the film saw while it was on [mA], once its server has ended."""
    return [entry.values[0] for entry in read_journal(folder / "journal.csv") if entry.event == "command"]


def ended_off(folder: Path) -> bool:
    """Whether the last that the device was told is to be off."""
    told = [
        entry.event for entry in read_journal(folder / "journal.csv") if entry.event in ("command", "off")
    ]
    return told[-1] == "off"


@pytest.mark.parametrize("wire", ["address", pytest.param("port", marks=pytest.mark.slow)])
def test_acquire_identify_run_at_a_source_meter(wire: str, tmp_path: Path) -> None:
    data, model, out = tmp_path / "data", tmp_path / "model.toml", tmp_path / "out"
    (tmp_path / "acquire.toml").write_text(ACQUIRE, encoding="utf-8")
    with served(tmp_path, wire) as there:
        assert main(["acquire", str(tmp_path / "acquire.toml"), "--out", str(data), "--quiet", *there]) == 0
        quick = ["--plays", "3", "--cells", "30", "--starts", "1", "--no-plot", "--quiet"]
        assert main(["identify", str(data / "dataset.toml"), "--out", str(model), *quick]) == 0
        short = settings("scenario.duration=3 s", "checks.tracking_mean_percent=12")
        run = ["run", "steps", "--quiet", "--no-plot", "--model", str(model), "--out", str(out)]
        main([*run, *LIVE, *short, *there])
    summary = summary_of(out)
    assert (summary["driver"], summary["faults"]) == ("scpi", [])
    assert summary["device"] == "KEITHLEY INSTRUMENTS,MODEL 2450,VO2-SLOW"
    timing = summary["timing"]
    assert timing["steps"] + timing["overruns"] == 150
    assert summary["self_sensing"]["mean_abs_percent"] < 1.5, "readings are from before their commands"
    assert summary["tracking"]["mean_abs_percent"] < 12.0
    assert all(3.679 <= level <= 8.4901 for level in levels_in_force(tmp_path))
    assert ended_off(tmp_path)


@pytest.mark.parametrize(
    ("end", "code"), [(signal.SIGTERM, 1), pytest.param(signal.SIGKILL, -9, marks=pytest.mark.slow)]
)
def test_a_stopped_or_killed_acquisition_leaves_the_output_off(
    end: signal.Signals, code: int, tmp_path: Path
) -> None:
    device = SlowDevice(enough=10)
    (tmp_path / "acquire.toml").write_text(ACQUIRE, encoding="utf-8")
    with instrument_at(device, "keithley-2600", str(tmp_path / "smu")) as port:
        there = settings(
            "driver.kind=scpi", f"driver.port={port}", "driver.table=keithley-2600",
            "driver.compliance_voltage=20 V", "driver.nplc=0.02",
        )  # fmt: skip
        command = [sys.executable, "-m", "rtctl", "acquire", str(tmp_path / "acquire.toml"), *there]
        with subprocess.Popen(
            [*command, "--out", str(tmp_path / "data")], stderr=subprocess.PIPE, text=True
        ) as process:
            assert device.has_enough.wait(30.0)
            assert device.enabled
            device.went_off.clear()
            process.send_signal(end)
            assert device.went_off.wait(10.0)
            _, errors = process.communicate(timeout=30)
        assert not device.enabled
    assert process.returncode == code, errors
    assert "Traceback" not in errors


@pytest.mark.slow
def test_the_latency_of_a_source_meter_is_its_reading_and_its_line(tmp_path: Path) -> None:
    options = [
        "--driver",
        "scpi",
        "--period",
        "10 ms",
        "--duration",
        "0.1 s",
        "--out",
        str(tmp_path),
        "--quiet",
    ]
    code = main(["latency", *options, *settings("clock.timeout=5 s", "clock.watchdog=10 s")])
    assert code in (0, 1), "what a loaded machine holds is nobody's claim here"
    (driver,) = json.loads((tmp_path / "latency.json").read_text(encoding="utf-8"))["drivers"]
    (entry,) = driver["periods"]
    assert entry["fault"] is None
    assert entry["steps"] + entry["overruns"] == 200
    assert entry["round_trip_us"]["p50"] > 3000.0, "0.1 power line cycles of 50 Hz, and 1 ms besides"


def test_a_slow_line_takes_the_time_of_its_bytes(tmp_path: Path) -> None:
    device = SlowDevice()
    wires = Wires(scpi=str(tmp_path / "smu"), instrument="keithley-2400", baud=4800)
    with in_thread(lambda: served_devices(device, wires)):
        driver = driver_at(serial_place(str(tmp_path / "smu"), 4800), "keithley-2400")
        driver.open(lockstep_period_us=None, watchdog_ms=0, timeout_s=5.0)
        begun_s = time.perf_counter()
        driver.exchange((5.0,))
        took_s = time.perf_counter() - begun_s
        driver.close((3.68,))
    assert (
        took_s
        > (len(":READ?;:SOUR:CURR 0.005\n") + len("+1.000000E+00,+1.000000E-03,+3.481600E+04\n")) * 10 / 4800
    )
