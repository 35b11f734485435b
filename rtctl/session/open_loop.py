"""An open-loop run: play a sequence of commands on an open device, and record what it reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from rtctl.border.arrays import FloatArray
from rtctl.border.records import Driver, Measurement
from rtctl.estimators.none import NoEstimator
from rtctl.loop.live_parameters import ParameterChannel
from rtctl.loop.supervisor import LoopOutcome, signal_columns
from rtctl.scenario.schema import Scenario
from rtctl.session.live.injected_faults import noted_faults
from rtctl.session.loop_setup import (
    ControlChain,
    build_parts,
    build_plan,
    build_playback,
    closed_on_error,
    run_on_clock,
    start_recording,
)
from rtctl.session.run_folder import RunFolder
from rtctl.timing.realtime import Request
from rtctl.timing.step_timing import StepTiming
from rtctl.wiring import build_limits


class OpenLoopRun(NamedTuple):
    """The results of an open-loop run."""

    signals: Mapping[str, FloatArray]
    """The recorded signals (n,) by name, in the units of the device's profile."""
    outcome: LoopOutcome
    timing: StepTiming
    requests: list[Request]
    """What came of each real-time request."""


def play(
    scenario: Scenario,
    driver: Driver,
    levels: FloatArray,
    first: Measurement,
    stop_requested: Callable[[], bool],
    folder: RunFolder | None = None,
    changes: ParameterChannel | None = None,
) -> OpenLoopRun:
    """Play `levels` of the first command on an open driver, then close it.

    Args:
        scenario: gives clock, limits and guards.
        driver: the open driver.
        levels: level of the first command in each sample (n,) [its unit].
        first: the reading with which the driver was opened.
        stop_requested: returns True once the run is to end.
        folder: where to record, as a closed-loop run does; None: into memory.
        changes: asks the run to stop while it lasts; None: nothing does.
    """
    chain = ControlChain(
        estimator=NoEstimator(), controller=build_playback(scenario), limits=build_limits(scenario, None)
    )
    with closed_on_error(driver, chain.safe_levels):
        columns = signal_columns(driver.profile, chain.estimator, chain.controller)
        recording = start_recording(columns, folder)
        try:
            parts = build_parts(scenario, driver, chain, recording, stop_requested, changes)
            with noted_faults(driver, recording):
                outcome, requests = run_on_clock(scenario, parts, build_plan(scenario, levels), first)
        finally:
            signals, _ = recording.close()
    return OpenLoopRun(signals, outcome, parts.timing, requests)
