"""Demonstration: acquire, identify, run, on a simulated device in another process behind a virtual serial line."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rtctl.border.errors import RunError
from rtctl.identification.vo2.identify import Vo2FitOptions, identify_vo2
from rtctl.identification.vo2.settling import assess_staircases, describe_settling
from rtctl.loop.live_parameters import ParameterChannel
from rtctl.measured.reading import read_dataset
from rtctl.models.vo2 import write_model
from rtctl.output.own_files import refuse_foreign
from rtctl.scenario.bundled import bundled_scenarios
from rtctl.scenario.schema import load_scenario
from rtctl.session.acquisition import acquire
from rtctl.session.closed_loop import track
from rtctl.session.live.control_socket import listening
from rtctl.session.run_files import write_run
from rtctl.session.run_folder import RunFolder, run_metadata, watch_words
from rtctl.wiring import build_driver

PLANT = "vo2"
Report = Callable[[str], None]


def demonstrate(
    device: str, seed: int, folder: Path, stop_requested: Callable[[], bool], report: Report
) -> list[dict[str, Any]]:
    """Acquire, identify and run every bundled tracking scenario over Modbus RTU; their summaries.

    Raises InputError where a file of another origin is in the way.
    """
    refuse_foreign(folder / "dataset" / "dataset.toml", "acquire")
    refuse_foreign(folder / "model.toml", "identify")
    report(watch_words(folder))
    with served_device(device, seed, report) as port:
        wire = ["driver.kind=modbus-rtu", f'driver.port="{port}"']
        files = bundled_scenarios()
        scenario, tables = load_scenario(files / "acquire_vo2.toml", wire)
        report("measuring the hysteresis through the line")
        manifest = acquire(
            scenario, build_driver(scenario, files), folder / "dataset", stop_requested, report, tables=tables
        )
        report("identifying")
        dataset = read_dataset(manifest)
        model = identify_vo2(dataset, Vo2FitOptions(), report)
        for record, settling in assess_staircases(model, dataset):
            if settling.is_useless:
                raise RunError(f"nothing is run with this model: {describe_settling(record, settling)}")
        write_model(model, folder / "model.toml")
        report(f"heating time constant {1e3 * model.time_constant_s:.3f} ms; wrote {folder / 'model.toml'}")
        summaries = []
        for file in sorted(files.glob("*.toml")):
            scenario, tables = load_scenario(file, wire)
            if file.stem.startswith("acquire") or scenario.scenario.plant != PLANT:
                continue
            report(f"running {file.stem}")
            place, metadata = folder / file.stem, run_metadata(tables)
            run_folder = RunFolder(path=place, metadata=metadata, model=folder / "model.toml", report=report)
            changes, driver = ParameterChannel(), build_driver(scenario, files)
            with listening(place, changes):
                result, outcome = track(scenario, model, driver, stop_requested, run_folder, changes)
            write_run(place, scenario, tables, result)
            summaries.append(result.summary)
            if outcome.fault is not None:
                raise RunError(f"{file.stem}: {outcome.fault}: {outcome.message}")
    return summaries


@contextmanager
def served_device(device: str, seed: int, report: Report) -> Iterator[str]:
    """Serve a simulated device in another process; yield the path of its serial port."""
    with tempfile.TemporaryDirectory(prefix="rtctl-") as folder:
        port = Path(folder) / "vo2"
        command = [
            sys.executable, "-m", "rtctl", "serve", device, "--modbus-rtu", str(port), "--seed", str(seed), "--quiet",
        ]  # fmt: skip
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True)
        try:
            _wait_until_ready(process)
            report(
                f"simulated device {device} in process {process.pid} on {port} (this is process {os.getpid()})"
            )
            yield str(port)
        finally:
            process.terminate()
            try:
                process.wait(timeout=5.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            if process.stdout is not None:
                process.stdout.close()


def _wait_until_ready(process: subprocess.Popen[str]) -> None:
    """Wait for the server's first line. Raises RunError if it ends without one."""
    started = time.monotonic()
    line = process.stdout.readline() if process.stdout is not None else ""
    if not line.startswith("ready"):
        code = process.wait()
        raise RunError(
            f"the simulated device ended with code {code} after {time.monotonic() - started:.1f} s without serving"
        )
