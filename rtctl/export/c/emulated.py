"""An exported loop that runs on the emulated Cortex-M4F against a device on a serial line, watched from here.

The board exchanges with the device, judges, estimates and commands; this computer writes its plan, starts the emulator
and reads what the board tells.
"""

from __future__ import annotations

import struct
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import Fault, InputError
from rtctl.evaluation.summary import summarise
from rtctl.export.c.laws.law import Law, aligned_dtype
from rtctl.export.c.laws.planning import law_of
from rtctl.export.c.proof.machines import MACHINES, emulated, missing
from rtctl.loop.step import upcoming_setpoints
from rtctl.loop.supervisor import LoopOutcome, signal_columns
from rtctl.plant_control.lookup import support_of
from rtctl.scenario.schema import Scenario
from rtctl.session.closed_loop import plan_control
from rtctl.session.run_files import RunResult
from rtctl.timing.step_timing import StepTiming

ANSWER_TIMEOUT_US = 5_000_000
"""For one answer; an emulated processor and a device in Python share this machine [us]."""
NO_ANSWER = 100
"""Fault of the board: see `boards/loop.c`."""
FAULTS = {
    1: (Fault.OUT_OF_RANGE, "an implausible reading"),
    2: (Fault.RATE, "a reading that changes too fast"),
    3: (Fault.FROZEN_VALUE, "a reading that does not follow on those before it"),
    4: (Fault.NOT_FINITE, "a command that is not finite"),
    5: (Fault.ENERGY_LIMIT, "a command beyond the limit of the mean square"),
    NO_ANSWER: (Fault.NO_ANSWER, "no answer of the device"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class EmulatedRun:
    """A run whose loop was closed by the emulated board."""

    result: RunResult
    """As that of `rtctl run`; nothing is known of the times of single samples."""
    fault: int
    """As the board told it; 0: none."""


def run_emulated(folder: Path, scenario: Scenario, model: Any, port: str) -> EmulatedRun:
    """Run an exported loop against a device.

    Args:
        folder: of `rtctl export c`, of this scenario and model.
        scenario: the checked scenario; the device is in lockstep.
        model: the model that the loop was exported from.
        port: serial line of the device, such as the one of `rtctl serve vo2_a --serial PATH`.

    Raises:
        InputError: compiler or emulator are missing, or the emulator did not run.
    """
    if lack := missing(MACHINES["m4f"]):
        raise InputError(f"the emulated loop: {lack}")
    made = subprocess.run(
        ["make", "-s", "-C", str(folder), "loop"], capture_output=True, text=True, check=False
    )
    if made.returncode:
        raise InputError(f"{folder}: the compiler says\n{made.stderr.strip()}")
    build = folder / "build" / "float"
    law = law_of(scenario, model)
    chain, setpoints, tuning = plan_control(scenario, model)
    preview_s = float(getattr(chain.controller, "preview_s", 0.0))
    upcoming = upcoming_setpoints(setpoints, scenario.scenario.period_s, preview_s)
    period_us = round(1e6 * scenario.scenario.period_s)
    head = struct.pack("<5I", period_us, 1, 0, ANSWER_TIMEOUT_US, len(setpoints))
    plan = np.stack((setpoints, upcoming), axis=1).astype(np.float32)
    (build / "plan.bin").write_bytes(head + plan.tobytes())
    command = [
        *MACHINES["m4f"].emulator, "-display", "none", "-monitor", "none", "-chardev", f"serial,id=line,path={port}",
        "-serial", "chardev:line", "-semihosting-config", "enable=on,target=native", "-kernel", "loop.elf",
    ]  # fmt: skip
    rows = np.frombuffer(emulated(command, build / "told.bin", MACHINES["m4f"].title), dtype=_row_dtype(law))
    fault = int(rows["out"]["fault"][-1])
    units = dict(signal_columns(scenario.profile, chain.estimator, chain.controller))
    signals = _signals(rows[:-1], list(units), [name for name, _ in chain.controller.terms])
    summary = _summary(scenario, model, signals, fault, len(setpoints))
    result = RunResult(summary=summary, signals=signals, units=units, timing={}, tuning=tuning)
    return EmulatedRun(result=result, fault=fault)


def _row_dtype(law: Law) -> np.dtype[Any]:
    """Return `loop_row` of `boards/loop.c`."""
    return np.dtype(
        [
            ("index", np.int32), ("reference", np.float32), ("commanded", np.float32),
            ("in", aligned_dtype(law.input, np.float32)), ("out", aligned_dtype(law.output, np.float32)),
        ],
        align=True,
    )  # fmt: skip


def _signals(rows: Any, names: list[str], terms: list[str]) -> dict[str, FloatArray]:
    """Return what the board told, by the names of a recording; `terms`: those of the controller."""
    taken, given = rows["in"], rows["out"]
    columns = [
        rows["index"], taken["setpoint"], given["estimate"], given["surrogate"], given["standard_error"],
        given["estimate_status"], rows["reference"], taken["sensed"], rows["commanded"],
        *(given[name] for name in terms), taken["counter"], taken["time_us"], taken["status"],
    ]  # fmt: skip
    return {name: np.asarray(values, dtype=np.float64) for name, values in zip(names, columns, strict=True)}


def _summary(
    scenario: Scenario, model: Any, signals: dict[str, FloatArray], fault: int, planned: int
) -> dict[str, Any]:
    steps = len(signals["index"])
    name, text = FAULTS.get(fault, (None, ""))
    if fault == 0 and steps < planned:
        name, text = Fault.INTERRUPTED, "the board told fewer samples than planned"
    outcome = LoopOutcome(steps=steps, overruns=0, fault=name, message=text)
    plant = support_of(scenario.scenario.plant)
    timing = StepTiming()
    timing.steps = steps
    return summarise(scenario, plant, model, outcome, signals, timing, [])
