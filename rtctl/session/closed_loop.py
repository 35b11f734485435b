"""One run from scenario to files: wire the parts, run the loop, record, score, draw.

`DIR/summary.json`, `DIR/signals.parquet` (units in its schema), `DIR/timing.parquet`, `DIR/run.png`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.border.records import Driver, Measurement
from rtctl.controllers.playback import PlaybackController
from rtctl.evaluation.metrics import write_json
from rtctl.evaluation.summary import summarise
from rtctl.interfaces import Column, Controller, Estimator
from rtctl.loop.compiled.step import compiled_step
from rtctl.loop.compiled.support import prepare
from rtctl.loop.live_parameters import ParameterChannel
from rtctl.loop.step import ReadableStep, Step
from rtctl.loop.supervisor import (
    TIMING_COLUMNS,
    LoopOutcome,
    LoopParts,
    LoopPlan,
    run_loop,
    signal_columns,
)
from rtctl.models.span import Span
from rtctl.plants.support import Control, Tuning, support_of
from rtctl.safety.guards import EnergyGuard
from rtctl.safety.limits import CommandLimits
from rtctl.scenario.command_sequence import check_length, check_one_period, played_levels, settling
from rtctl.scenario.schema import Scenario
from rtctl.session.run_folder import Recording, RunFolder, in_memory, run_metadata, write_tables
from rtctl.timing.realtime import Request, real_time
from rtctl.timing.step_timing import StepTiming
from rtctl.wiring import (
    build_clock,
    build_control,
    build_estimator,
    build_guard,
    build_limits,
    build_plausibility,
)

LIVE_TIMEOUT_PERIODS = 5.0
LEAST_LIVE_TIMEOUT_S = 0.05
LOCKSTEP_TIMEOUT_S = 1.0
WATCHDOG_PERIODS = 10.0
LEAST_WATCHDOG_S = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """What came of a run."""

    summary: dict[str, Any]
    signals: Mapping[str, FloatArray]
    units: Mapping[str, str]
    """Of the signals."""
    timing: Mapping[str, FloatArray]
    tuning: Tuning | None


def open_driver(driver: Driver, scenario: Scenario) -> Measurement:
    """Open with the scenario's clock, timeout and watchdog. Raises InputError where nothing is at the port."""
    if scenario.clock.unlocked and (scenario.reference is None or scenario.estimator.kind == "observer"):
        prepare(driver)
    lockstep = scenario.clock.mode == "lockstep"
    period_s = scenario.scenario.period_s
    timeout_s = scenario.clock.timeout_s or (
        LOCKSTEP_TIMEOUT_S if lockstep else max(LIVE_TIMEOUT_PERIODS * period_s, LEAST_LIVE_TIMEOUT_S)
    )
    watchdog_s = scenario.clock.watchdog_s
    if watchdog_s is None:
        watchdog_s = 0.0 if lockstep else max(WATCHDOG_PERIODS * period_s, LEAST_WATCHDOG_S)
    try:
        return driver.open(
            lockstep_period_us=round(period_s * 1e6) if lockstep else None,
            watchdog_ms=round(watchdog_s * 1e3),
            timeout_s=timeout_s,
        )
    except DriverError as error:
        if error.fault is Fault.CONNECTION_LOST:  # nothing there to begin with: the port or address is wrong
            raise InputError(str(error)) from None
        raise


def setpoints_of(scenario: Scenario, reach: Span) -> FloatArray:
    """The setpoint of each sample [controlled unit]. Raises InputError where it leaves the range `reach`."""
    assert scenario.reference is not None
    period_s, duration_s = scenario.scenario.period_s, scenario.scenario.duration_s or 0.0
    check_length(duration_s / period_s)
    time_s = period_s * np.arange(round(duration_s / period_s), dtype=np.float64)
    try:
        setpoints = scenario.reference.build(time_s, *reach)
    except ValueError as error:
        raise InputError(str(error)) from None
    low, high, unit = float(setpoints.min()), float(setpoints.max()), scenario.profile.reference.unit
    if not (low >= reach.low and high <= reach.high):
        raise InputError(
            f"[reference] asks for {low:.4g} to {high:.4g} {unit}, the model reaches {reach.low:.4g} to "
            f"{reach.high:.4g} {unit}; give levels inside it, or in percent of the range"
        )
    return setpoints


def track(
    scenario: Scenario,
    model: Any,
    driver: Driver,
    stop_requested: Callable[[], bool],
    folder: RunFolder | None = None,
    changes: ParameterChannel | None = None,
) -> tuple[RunResult, LoopOutcome]:
    """A closed-loop run, or an open-loop one where the scenario has excitations (self-sensing only).

    `model` is of the scenario's kind of plant (`rtctl.plants`). Recorded into `folder` while it runs; None: into
    memory. `changes`: of parameters while it runs.
    """
    plant = support_of(scenario.scenario.plant)
    reach = plant.output_range(scenario, model)
    setpoints, (controller, tuning) = _plan_control(scenario, model, reach)
    limits = build_limits(scenario, model if scenario.reference is not None else None)
    estimator = build_estimator(scenario, model)
    safe = tuple(limit.safe for limit in limits)
    step = compiled_step(estimator, controller, limits)
    _compile(estimator, controller, step, safe, plant.reading_at_rest(model))
    first = open_driver(driver, scenario)
    try:
        _check_identity(scenario, plant.identity(model), driver.identity)
    except InputError:
        driver.close(safe)
        raise
    columns = signal_columns(driver.profile, estimator, controller)
    recording = _recording(driver, safe, columns, folder)
    parts = _parts(scenario, driver, estimator, controller, limits, recording, stop_requested, changes, step)
    try:
        outcome, requests = run_in_time(scenario, parts, loop_plan(scenario, setpoints), first)
    finally:
        table, timing = recording.close()
    summary = summarise(scenario, plant, model, outcome, table, parts.timing, requests)
    return RunResult(
        summary=summary, signals=table, units=dict(columns), timing=timing, tuning=tuning
    ), outcome


def planned_step(scenario: Scenario, model: Any) -> tuple[Step, FloatArray, list[str]]:
    """What decides in a run of `scenario`, the setpoints of its samples, the names of the controller's terms.

    Raises InputError.
    """
    reach = support_of(scenario.scenario.plant).output_range(scenario, model)
    setpoints, (controller, _) = _plan_control(scenario, model, reach)
    limits = build_limits(scenario, model if scenario.reference is not None else None)
    step = ReadableStep(
        build_estimator(scenario, model), controller, limits
    )  # the oracle of the compiled one
    return step, setpoints, [name for name, _ in controller.terms]


def _recording(
    driver: Driver, safe: tuple[float, ...], columns: list[Column], folder: RunFolder | None
) -> Recording:
    """Where the rows go. Closes the driver where they cannot go there."""
    if folder is None:
        return in_memory(columns, TIMING_COLUMNS)
    try:
        return folder.record(columns, TIMING_COLUMNS)
    except BaseException:
        driver.close(safe)
        raise


def run_in_time(
    scenario: Scenario, parts: LoopParts, plan: LoopPlan, first: Measurement
) -> tuple[LoopOutcome, list[Request]]:
    """`run_loop`; live with what `[clock]` asks of the machine, and what came of each request."""
    if scenario.clock.mode == "lockstep":
        return run_loop(parts, plan, first), []
    with real_time(scenario.clock.real_time()) as requests:
        return run_loop(parts, plan, first), requests


def _compile(
    estimator: Estimator,
    controller: Controller,
    step: Step | None,
    levels: tuple[float, ...],
    sensed: tuple[float, ...],
) -> None:
    """One step of each before the device is opened: compiling lasts seconds, its watchdog a tenth of one."""
    estimate = estimator.start(levels, sensed)
    controller.start(levels, estimate.value, estimate)
    controller.step(estimate.value, estimate.value, estimator.step(levels, sensed, 1e-3), 1e-3)
    if step is not None:
        step.start(levels, estimate.value, sensed, 1e-3)
        step.step(estimate.value, estimate.value, levels, levels, sensed, 1e-3)


def _check_identity(scenario: Scenario, identified: str, found: str) -> None:
    if scenario.scenario.any_device or not identified or not found:
        return
    if identified != found:
        raise InputError(
            f'the model was identified on "{identified}", the device answers "{found}"; identify this '
            "device (rtctl acquire, rtctl identify), or pass --set scenario.any_device=true"
        )


def _plan_control(scenario: Scenario, model: Any, reach: Span) -> tuple[FloatArray, Control]:
    if scenario.reference is None:
        check_one_period(scenario)
        return np.concatenate(played_levels(scenario)), Control(_playback(scenario), None)
    control = build_control(scenario, model)
    return setpoints_of(scenario, reach), control


def _playback(scenario: Scenario) -> PlaybackController:
    """Plays the first command; the further ones stay where they are safe."""
    first, *further = scenario.profile.commands
    tables = scenario.limits.commands(scenario.profile)[1:]
    assert len(further) == len(tables)
    return PlaybackController(first.unit, [table.safe_level for table in tables])


def loop_plan(scenario: Scenario, setpoints: FloatArray) -> LoopPlan:
    """The loop's plan for given setpoints."""
    period_s = scenario.scenario.period_s
    return LoopPlan(
        period_s=period_s,
        setpoints=setpoints,
        settle_steps=settling(scenario),
        reading_delay=scenario.reading_delay,
        rearm_times=scenario.safety.rearm,
        rearm_after_s=scenario.safety.rearm_after_s,
    )


def _parts(
    scenario: Scenario,
    driver: Driver,
    estimator: Estimator,
    controller: Controller,
    limits: tuple[CommandLimits, ...],
    recording: Recording,
    stop_requested: Callable[[], bool],
    changes: ParameterChannel | None = None,
    step: Step | None = None,
) -> LoopParts:
    profile = driver.profile
    return LoopParts(
        driver=driver,
        estimator=estimator,
        controller=controller,
        limits=limits,
        plausibility=build_plausibility(scenario, profile),
        clock=build_clock(scenario),
        signals=recording.signals,
        timings=recording.timings,
        stop_requested=stop_requested,
        step=step,
        unlocked=scenario.clock.unlocked,
        guard=build_guard(scenario, profile),
        energy=EnergyGuard(limits, [f"{channel.name} [{channel.unit}]" for channel in profile.commands]),
        reopen=(lambda: open_driver(driver, scenario)) if scenario.safety.rearm else None,
        timing=StepTiming(scenario.clock.stop_after if scenario.clock.missed == "stop" else None),
        events=recording.events,
        changes=ParameterChannel() if changes is None else changes,  # an empty one is false
    )


def play(
    scenario: Scenario,
    driver: Driver,
    levels: FloatArray,
    first: Measurement,
    stop_requested: Callable[[], bool],
) -> tuple[Mapping[str, FloatArray], LoopOutcome]:
    """Play levels of the first command open-loop on an open driver; the recorded signals. Closes the driver."""
    played = _played(scenario, driver, levels, first, stop_requested, None)
    return played.signals, played.outcome


def time_the_loop(
    scenario: Scenario,
    driver: Driver,
    levels: FloatArray,
    first: Measurement,
    stop_requested: Callable[[], bool],
    folder: RunFolder,
) -> tuple[LoopOutcome, StepTiming, list[Request]]:
    """`play`, recorded into `folder` as a run is, of which only the times are wanted. Closes the driver."""
    played = _played(scenario, driver, levels, first, stop_requested, folder)
    return played.outcome, played.timing, played.requests


class _Played(NamedTuple):
    signals: Mapping[str, FloatArray]
    outcome: LoopOutcome
    timing: StepTiming
    requests: list[Request]


def _played(
    scenario: Scenario,
    driver: Driver,
    levels: FloatArray,
    first: Measurement,
    stop_requested: Callable[[], bool],
    folder: RunFolder | None,
) -> _Played:
    from rtctl.estimators.none import NoEstimator

    estimator, controller, limits = NoEstimator(), _playback(scenario), build_limits(scenario, None)
    safe = tuple(limit.safe for limit in limits)
    recording = _recording(driver, safe, signal_columns(driver.profile, estimator, controller), folder)
    parts = _parts(scenario, driver, estimator, controller, limits, recording, stop_requested)
    try:
        outcome, requests = run_in_time(scenario, parts, loop_plan(scenario, levels), first)
    finally:
        signals, _ = recording.close()
    return _Played(signals, outcome, parts.timing, requests)


def write_run(folder: Path, scenario: Scenario, tables: Mapping[str, Any], result: RunResult) -> None:
    """All files of a run; the summary after the recordings, so that a folder with a summary has them whole.

    `tables`: the scenario as it was run, overrides included; it goes into the recording's metadata.
    """
    (folder / "summary.json").unlink(missing_ok=True)  # of an earlier run in the same folder
    write_tables(folder, result.signals, result.timing, result.units, run_metadata(tables))
    write_json(folder / "summary.json", result.summary)
    if len(result.signals["index"]) > 1:  # last: a picture takes longest, and nothing depends on it
        draw_run(folder / "run.png", scenario, result)


def draw_run(path: Path, scenario: Scenario, result: RunResult) -> None:
    """The picture of a run."""
    from rtctl.plots import plot_run

    plot_run(
        path,
        scenario.scenario.period_s * result.signals["index"],
        result.signals,
        title=scenario.scenario.title,
        closed_loop=scenario.reference is not None,
        range_um=result.summary["range_um"],
        profile=scenario.profile,
    )
