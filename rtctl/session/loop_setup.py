"""What closed-loop and open-loop runs share: opening the device, building the loop's parts, and running the loop."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.border.records import Driver, Measurement
from rtctl.controllers.playback import PlaybackController
from rtctl.interfaces import Column, Controller, Estimator
from rtctl.loop.compiled.support import compile_kernels, prepare
from rtctl.loop.live_parameters import ParameterChannel
from rtctl.loop.step import Step
from rtctl.loop.supervisor import TIMING_COLUMNS, LoopOutcome, LoopParts, LoopPlan, run_loop
from rtctl.safety.guards import EnergyGuard
from rtctl.safety.limits import CommandLimits
from rtctl.scenario.command_sequence import settling
from rtctl.scenario.schema import Scenario
from rtctl.session.run_folder import Recording, RunFolder, in_memory
from rtctl.timing.realtime import Request, real_time
from rtctl.timing.step_timing import StepTiming
from rtctl.wiring import build_clock, build_guard, build_plausibility

LIVE_TIMEOUT_PERIODS = 5.0
LEAST_LIVE_TIMEOUT_S = 0.05
LOCKSTEP_TIMEOUT_S = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlChain:
    """The estimator, controller and command limits of a run."""

    estimator: Estimator
    controller: Controller
    limits: tuple[CommandLimits, ...]
    step: Step | None = None
    """The same three as one compiled call; None: the loop calls one after the other."""

    @property
    def safe_levels(self) -> tuple[float, ...]:
        """The level of each command at which the device is at rest [its unit]."""
        return tuple(limit.safe for limit in self.limits)


def open_driver(driver: Driver, scenario: Scenario) -> Measurement:
    """Open `driver` with the clock, timeout and watchdog of `scenario`; return the first reading.

    Raises:
        InputError: nothing answers at the port or address.
        DriverError: the device answers with a fault.
    """
    compile_kernels()
    if scenario.clock.unlocked and (scenario.reference is None or scenario.estimator.kind == "observer"):
        prepare(driver)
    lockstep = scenario.clock.mode == "lockstep"
    period_s = scenario.scenario.period_s
    timeout_s = scenario.clock.timeout_s or (
        LOCKSTEP_TIMEOUT_S if lockstep else max(LIVE_TIMEOUT_PERIODS * period_s, LEAST_LIVE_TIMEOUT_S)
    )
    try:
        return driver.open(
            lockstep_period_us=round(period_s * 1e6) if lockstep else None,
            watchdog_ms=round(_lease_s(scenario) * 1e3),
            timeout_s=timeout_s,
        )
    except DriverError as error:
        if error.fault is Fault.CONNECTION_LOST:  # nothing there to begin with: the port or address is wrong
            raise InputError(str(error)) from None
        raise


@contextmanager
def closed_on_error(driver: Driver, safe_levels: tuple[float, ...]) -> Iterator[None]:
    """Close an open driver at the safe levels where the body raises, whatever it is: no device is left armed."""
    try:
        yield
    except BaseException:
        driver.close(safe_levels)
        raise


def _lease_s(scenario: Scenario) -> float:
    """Return how long the device holds a command that is not renewed [s]; a device in this process ends with it."""
    if scenario.driver.kind == "inprocess" and scenario.clock.mode == "lockstep":
        return scenario.clock.watchdog_s or 0.0
    return scenario.clock.lease_s(scenario.scenario.period_s)


def build_playback(scenario: Scenario) -> PlaybackController:
    """Return the controller that plays the first command and holds the other ones at their safe levels."""
    first, *further = scenario.profile.commands
    tables = scenario.limits.commands(scenario.profile)[1:]
    assert len(further) == len(tables)
    return PlaybackController(first.unit, [table.safe_level for table in tables])


def build_plan(scenario: Scenario, setpoints: FloatArray) -> LoopPlan:
    """Return the loop's plan for `setpoints` (n,) [controlled unit, or that of the first command]."""
    return LoopPlan(
        period_s=scenario.scenario.period_s,
        setpoints=setpoints,
        settle_steps=settling(scenario),
        reading_delay=scenario.reading_delay,
        rearm_times=scenario.safety.rearm,
        rearm_after_s=scenario.safety.rearm_after_s,
        watchdog_s=_lease_s(scenario),
    )


def build_parts(
    scenario: Scenario,
    driver: Driver,
    chain: ControlChain,
    recording: Recording,
    stop_requested: Callable[[], bool],
    changes: ParameterChannel | None = None,
) -> LoopParts:
    """Return everything that the loop calls in a run of `scenario`.

    Args:
        scenario: the checked scenario.
        driver: the driver of the open device.
        chain: estimator, controller and limits.
        recording: where rows and events go.
        stop_requested: returns True once the run is to end.
        changes: set-points and gains that change while the loop runs; None: none do.
    """
    profile = driver.profile
    return LoopParts(
        driver=driver,
        estimator=chain.estimator,
        controller=chain.controller,
        limits=chain.limits,
        plausibility=build_plausibility(scenario, profile),
        clock=build_clock(scenario),
        signals=recording.signals,
        timings=recording.timings,
        stop_requested=stop_requested,
        step=chain.step,
        compiled=scenario.clock.unlocked,
        guard=build_guard(scenario, profile),
        energy=EnergyGuard(
            chain.limits, [f"{channel.name} [{channel.unit}]" for channel in profile.commands]
        ),
        reopen=(lambda: open_driver(driver, scenario)) if scenario.safety.rearm else None,
        timing=StepTiming(scenario.clock.stop_after if scenario.clock.missed == "stop" else None),
        events=recording.events,
        changes=ParameterChannel() if changes is None else changes,  # an empty channel is false
    )


def start_recording(columns: list[Column], folder: RunFolder | None) -> Recording:
    """Start recording signals of these names and units into `folder`, or into memory if there is none."""
    return in_memory(columns, TIMING_COLUMNS) if folder is None else folder.record(columns, TIMING_COLUMNS)


def run_on_clock(
    scenario: Scenario, parts: LoopParts, plan: LoopPlan, first: Measurement
) -> tuple[LoopOutcome, list[Request]]:
    """Run the loop; a live one with the real-time settings of `[clock]`.

    Args:
        scenario: the checked scenario.
        parts: what the loop calls.
        plan: what the loop does.
        first: the reading with which the driver was opened.

    Returns:
        The loop's outcome, and what came of each real-time request (none in lockstep).
    """
    if scenario.clock.mode == "lockstep":
        return run_loop(parts, plan, first), []
    with real_time(scenario.clock.real_time()) as requests:
        return run_loop(parts, plan, first), requests
