"""A closed-loop run: wire estimator and controller to the device, run the loop, record, and score the result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.border.records import Driver
from rtctl.evaluation.summary import summarise
from rtctl.loop.compiled.step import compiled_step
from rtctl.loop.live_parameters import ParameterChannel
from rtctl.loop.step import ReadableStep, Step
from rtctl.loop.supervisor import LoopOutcome, signal_columns
from rtctl.models.span import Span
from rtctl.plant_control.lookup import support_of
from rtctl.plant_control.support import Control, Tuning
from rtctl.scenario.command_sequence import check_length, check_one_period, command_sequences
from rtctl.scenario.further_references import course
from rtctl.scenario.schema import Scenario
from rtctl.session.live.change_rules import ChangeRules
from rtctl.session.live.injected_faults import noted_faults
from rtctl.session.live.successors import Successors
from rtctl.session.loop_setup import (
    ControlChain,
    build_parts,
    build_plan,
    build_playback,
    closed_on_error,
    open_driver,
    run_on_clock,
    start_recording,
)
from rtctl.session.run_files import RunResult
from rtctl.session.run_folder import RunFolder
from rtctl.wiring import build_control, build_estimator, build_limits

WARM_UP_S = 1e-3
"""Time [s] of the step that compiles estimator and controller; its results are forgotten."""


def track(
    scenario: Scenario,
    model: Any,
    driver: Driver,
    stop_requested: Callable[[], bool],
    folder: RunFolder | None = None,
    changes: ParameterChannel | None = None,
) -> tuple[RunResult, LoopOutcome]:
    """Run the loop closed, or open with an estimator beside it if the scenario has excitations (self-sensing only).

    Args:
        scenario: the checked scenario.
        model: the identified model, of the scenario's kind of plant (`rtctl.plants`).
        driver: the driver of the device, closed; it is opened here and closed at the end.
        stop_requested: returns True once the run is to end.
        folder: where to record while the loop runs; None: into memory.
        changes: set-points and gains that change while the loop runs; None: none do.

    Raises:
        InputError: the setpoint leaves the model's range, or the device is another one than the model's.
        DriverError: the device cannot be opened.
    """
    plant = support_of(scenario.scenario.plant)
    chain, setpoints, tuning = plan_control(scenario, model)
    chain = replace(chain, step=compiled_step(chain.estimator, chain.controller, chain.limits))
    _compile(chain, plant.reading_at_rest(model))
    first = open_driver(driver, scenario)
    with closed_on_error(driver, chain.safe_levels):
        _check_identity(scenario, plant.identity(model), driver.identity)
        columns = signal_columns(driver.profile, chain.estimator, chain.controller)
        recording = start_recording(columns, folder)
        try:
            if changes is not None:
                rules = ChangeRules(scenario, model, chain.controller, plant.output_range(scenario, model))
                rules.judge_changes_of(changes)
                if folder is not None and scenario.reference is not None:
                    changes.prepare = rules.follows(
                        Successors(folder.path, scenario, chain.limits, setpoints)
                    )
            parts = build_parts(scenario, driver, chain, recording, stop_requested, changes)
            with noted_faults(driver, recording):
                outcome, requests = run_on_clock(scenario, parts, build_plan(scenario, setpoints), first)
        finally:
            table, timing = recording.close()
    summary = summarise(scenario, plant, model, outcome, table, parts.timing, requests)
    return RunResult(
        summary=summary, signals=table, units=dict(columns), timing=timing, tuning=tuning,
        changes=tuple(event for event in parts.events.noted if event.kind == "change"),
    ), outcome  # fmt: skip


def planned_step(scenario: Scenario, model: Any) -> tuple[Step, FloatArray, list[str]]:
    """Return the step, the setpoints and the names of the controller's terms with which `scenario` runs.

    Returns:
        The step in Python, which is the oracle of the compiled one; setpoints (n,) [controlled unit]; names.

    Raises:
        InputError: the setpoint leaves the model's range.
    """
    chain, setpoints, _ = plan_control(scenario, model)
    step = ReadableStep(chain.estimator, chain.controller, chain.limits)
    return step, setpoints, [name for name, _ in chain.controller.terms]


def setpoints_of(scenario: Scenario, reach: Span) -> FloatArray:
    """Return the setpoint of each sample (n,) [controlled unit].

    Raises:
        InputError: it leaves `reach`, the range of the model's output.
    """
    assert scenario.reference is not None
    period_s, duration_s = scenario.scenario.period_s, scenario.scenario.duration_s or 0.0
    check_length(duration_s / period_s)
    time_s = period_s * np.arange(round(duration_s / period_s), dtype=np.float64)
    return course(scenario.reference, time_s, reach, scenario.profile.reference.unit, "reference")


def plan_control(scenario: Scenario, model: Any) -> tuple[ControlChain, FloatArray, Tuning | None]:
    """Return estimator, controller and limits, the setpoints (n,), and how the controller was tuned."""
    plant = support_of(scenario.scenario.plant)
    reach = plant.output_range(scenario, model)
    if scenario.reference is None:
        check_one_period(scenario)
        setpoints = np.concatenate(command_sequences(scenario))
        control, limits = Control(build_playback(scenario), None), build_limits(scenario, None)
    else:
        control = build_control(scenario, model)
        setpoints, limits = setpoints_of(scenario, reach), build_limits(scenario, model)
    estimator = build_estimator(scenario, model)
    chain = ControlChain(estimator=estimator, controller=control.controller, limits=limits)
    return chain, setpoints, control.tuning


def _compile(chain: ControlChain, sensed: tuple[float, ...]) -> None:
    """Take one step with each part before the device is opened: compiling lasts seconds, its watchdog 0.1 s."""
    levels, estimator, controller = chain.safe_levels, chain.estimator, chain.controller
    estimate = estimator.start(levels, sensed)
    controller.start(levels, estimate.value, estimate)
    controller.step(estimate.value, estimate.value, estimator.step(levels, sensed, WARM_UP_S), WARM_UP_S)
    if chain.step is not None:
        chain.step.start(levels, estimate.value, sensed, WARM_UP_S)
        chain.step.step(estimate.value, estimate.value, levels, levels, sensed, WARM_UP_S)


def _check_identity(scenario: Scenario, identified: str, answered: str) -> None:
    """Raise InputError if the device is another one than the one that the model was identified on."""
    if scenario.scenario.any_device or not identified or not answered:
        return
    if identified != answered:
        raise InputError(
            f'the model was identified on "{identified}", the device answers "{answered}"; identify this '
            "device (rtctl acquire, rtctl identify), or pass --set scenario.any_device=true"
        )
