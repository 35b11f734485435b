"""Compiled blocks take the loop's samples as Python does: the same commands, rows and faults, to the bit."""

from __future__ import annotations

import math
import signal
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loop_cases import FIRST, SAFE, SETTLE, levels_mA
from scripted_line import ScriptedLine

from rtctl.border.errors import Fault
from rtctl.border.records import DeviceStatus, Measurement
from rtctl.border.wire.compiled_clock import AVAILABLE
from rtctl.border.wire.wire_memory import Ended
from rtctl.controllers.feedforward import InverseFeedforward
from rtctl.controllers.pi import NoFeedforward, PiController, PiGains
from rtctl.controllers.playback import PlaybackController
from rtctl.estimators.none import NoEstimator
from rtctl.estimators.observer import ObserverEstimator
from rtctl.interfaces import Clock, Controller, Estimator
from rtctl.loop.compiled.step import compiled_step
from rtctl.loop.compiled.support import BLOCKS, prepare
from rtctl.loop.live_parameters import ParameterChannel
from rtctl.loop.supervisor import TIMING_COLUMNS, LoopOutcome, LoopParts, LoopPlan, run_loop, signal_columns
from rtctl.models.span import Span
from rtctl.models.vo2 import Vo2Model
from rtctl.recording import Recorder
from rtctl.recording.mapped import Keeper, MappedRecorder
from rtctl.safety.guards import EnergyGuard, ReadingGuard, ReadingRules
from rtctl.safety.limits import CommandLimits
from rtctl.safety.plausibility import Plausibility
from rtctl.timing.clock import Missed, MonotonicClock, SimulatedClock, TrackedSpin
from rtctl.timing.step_timing import StepTiming

pytestmark = pytest.mark.skipif(not AVAILABLE, reason="this machine has no compiled loop")

SAMPLES = 14
ENABLED = int(DeviceStatus.ENABLED)
BEFORE_FIRST = FIRST._replace(time_us=(-1000) & 0xFFFFFFFF)
NAMES = ("resistance [ohm]",)
LIMIT = CommandLimits(low=SAFE, high=9.0, safe=SAFE)


def healthy(k: int, ohm: float = math.nan) -> Measurement:
    sensed = 50e3 + k if math.isnan(ohm) else ohm
    return Measurement((sensed,), 10.0 + k, (8 + k) & 0xFFFFFFFF, (1000 * k) & 0xFFFFFFFF, k, ENABLED)


@dataclass(kw_only=True)
class Case:
    """What both ways are given."""

    answers: list[Measurement | Ended]
    rules: ReadingRules | None = None
    limit: CommandLimits = LIMIT
    setpoints: list[float] = field(default_factory=lambda: [levels_mA(k) for k in range(SAMPLES)])
    delay: int = 0
    changes: tuple[tuple[str, float], ...] = ()
    model: Vo2Model | None = None
    """Observer and PI instead of a playback."""
    forward: bool = False


@dataclass(frozen=True)
class Taken:
    """What has come of it."""

    outcome: LoopOutcome
    commands: list[float]
    closed_with: list[tuple[float, ...]]
    rows: list[bytes]
    events: list[str]


def taken(case: Case, compiled: bool, clock: Clock | None = None) -> Taken:
    driver = ScriptedLine(case.answers)
    estimator, controller = decides(case)
    limits = (case.limit,)
    signals = Recorder(signal_columns(driver.profile, estimator, controller))
    channel = ParameterChannel()
    for name, value in case.changes:
        channel.offer(name, value)
    parts = LoopParts(
        driver=driver,
        estimator=estimator,
        controller=controller,
        limits=limits,
        plausibility=Plausibility(sensed_low=(100.0,), sensed_high=(10e6,), names=NAMES),
        clock=clock or SimulatedClock(),
        signals=signals,
        timings=Recorder(TIMING_COLUMNS),
        stop_requested=lambda: False,
        step=None if case.model is None else compiled_step(estimator, controller, limits),
        compiled=compiled,
        guard=None if case.rules is None else ReadingGuard(case.rules),
        energy=EnergyGuard(limits, ["current [mA]"]),
        changes=channel,
    )
    plan = LoopPlan(
        period_s=1e-3, setpoints=np.array(case.setpoints), settle_steps=SETTLE, reading_delay=case.delay
    )
    outcome = run_loop(parts, plan, BEFORE_FIRST)
    if outcome.taken_in:  # a first level that is none comes before every sample
        assert outcome.taken_in == BLOCKS if compiled else outcome.taken_in.startswith("Python")
    assert parts.timing.lateness.count == parts.timing.compute.count == outcome.steps
    table = np.column_stack(list(signals.table().values()))
    return Taken(
        replace(outcome, taken_in=""),
        driver.commands,
        driver.closed_with,
        [row.tobytes() for row in table],
        [f"{event.step} {event.kind} {event.values!r}" for event in parts.events.noted],
    )


def decides(case: Case) -> tuple[Estimator, Controller]:
    if case.model is None:
        return NoEstimator(), PlaybackController()
    forward = InverseFeedforward(case.model, Span(3.68, 8.49)) if case.forward else NoFeedforward()
    return ObserverEstimator(case.model), PiController(PiGains(kp=0.02, ki=8.0), forward, deadband=0.05)


def same_both_ways(case: Case) -> Taken:
    python, compiled = taken(case, False), taken(case, True)
    assert compiled == python
    return compiled


LOCKSTEP = ReadingRules(names=NAMES, rates=(5e3,), frozen_after=3, frozen_travel=0.1, lockstep_us=1000)
LIVE = ReadingRules(
    names=NAMES, rates=(math.inf,), time_tolerance_us=1e12
)  # the script is older than the run
Odd = tuple[int, str, float]
ODD: dict[str, st.SearchStrategy[float]] = {
    "sensed": st.sampled_from([math.nan, math.inf, -1.0, 99.0, 1e9, 50_000.0, 50_006.5, 50_001.0]),
    "counter": st.integers(-3, 3).map(float) | st.sampled_from([2.0**31, -(2.0**31)]),
    "time_us": st.sampled_from([-1000.0, -3.0, -2.0, 2.0, 3.0, 500.0, 2.0**31, 4e9]),
    "status": st.integers(0, 31).map(float),
    "ended": st.integers(1, 6).map(float),
}
odd = st.sampled_from(list(ODD)).flatmap(
    lambda key: st.tuples(st.integers(SETTLE, SETTLE + SAMPLES - 1), st.just(key), ODD[key])
)


def changed(answer: Measurement | Ended, key: str, value: float) -> Measurement | Ended:
    if isinstance(answer, Ended) or key == "ended":
        return Ended(int(value)) if key == "ended" else answer
    if key == "sensed":
        return answer._replace(sensed=(value,))
    if key == "status":
        return answer._replace(status=int(value))
    before = answer.counter if key == "counter" else answer.time_us
    return answer._replace(**{key: (before + int(value)) & 0xFFFFFFFF})


@settings(deadline=None, max_examples=300)
@given(
    oddities=st.lists(odd, max_size=3),
    rules=st.sampled_from([None, LOCKSTEP, replace(LOCKSTEP, timed=False), LIVE]),
    limit=st.sampled_from(
        [
            LIMIT,
            replace(LIMIT, slew_per_s=60.0),
            replace(LIMIT, rms=5.4, rms_window_s=4e-3),
            replace(LIMIT, high=5.5),
        ]
    ),
    setpoint=st.none() | st.tuples(st.integers(0, SAMPLES - 1), st.sampled_from([math.nan, 0.0, 5.05, 50.0])),
    delay=st.integers(0, 2),
    frozen=st.booleans(),
)
def test_whatever_the_device_says_both_ways_do_the_same(
    oddities: list[Odd], rules: ReadingRules | None, limit: CommandLimits, setpoint: tuple[int, float] | None,
    delay: int, frozen: bool,
) -> None:  # fmt: skip
    answers: list[Measurement | Ended] = [healthy(k) for k in range(SETTLE + SAMPLES)]
    for at, key, value in oddities:
        answers[at] = changed(answers[at], key, value)
    if frozen:
        answers[SETTLE + 4 : SETTLE + 9] = [
            changed(answer, "sensed", 50_007.0) for answer in answers[SETTLE + 4 : SETTLE + 9]
        ]
    case = Case(answers=answers, rules=rules, limit=limit, delay=delay)
    if setpoint is not None:
        case.setpoints[setpoint[0]] = setpoint[1]
    same_both_ways(case)


NAMED: dict[str, tuple[int, str, float, Fault]] = {
    "not finite": (6, "sensed", math.nan, Fault.NOT_FINITE),
    "out of range": (6, "sensed", 1e9, Fault.OUT_OF_RANGE),
    "too fast": (6, "sensed", 50_020.0, Fault.RATE),
    "counter stands": (6, "counter", -1.0, Fault.FROZEN_COUNTER),
    "counter jumps": (6, "counter", 1.0, Fault.COUNTER_JUMP),
    "device time": (6, "time_us", 500.0, Fault.DEVICE_TIME),
    "watchdog": (6, "status", 3.0, Fault.WATCHDOG_TRIPPED),
    "sensor": (6, "status", 9.0, Fault.SENSOR_FAULT),
    "refused": (6, "status", 17.0, Fault.COMMAND_REFUSED),
    "off": (6, "status", 0.0, Fault.NOT_ENABLED),
    "silence": (6, "ended", 1.0, Fault.NO_ANSWER),
}


@pytest.mark.parametrize("name", NAMED)
def test_each_fault_has_its_name_and_the_next_command_is_the_safe_one(name: str) -> None:
    at, key, value, fault = NAMED[name]
    answers: list[Measurement | Ended] = [healthy(k) for k in range(SETTLE + SAMPLES)]
    answers[SETTLE + at] = changed(answers[SETTLE + at], key, value)
    found = same_both_ways(Case(answers=answers, rules=LOCKSTEP))
    assert (found.outcome.fault, found.outcome.steps) == (fault, at)
    assert found.commands == SETTLE * [SAFE] + [levels_mA(k) for k in range(at + 1)]
    assert found.closed_with == [(SAFE,)]


@pytest.mark.parametrize("forward", [False, True])
def test_observer_and_pi_with_changes_on_the_way(identified: object, forward: bool) -> None:
    """Long enough for several blocks; the set-points leave what can be reached, so that limits and integral act."""
    model = identified("vo2_a").model  # type: ignore[operator]
    samples, random = 2600, np.random.default_rng(3)
    low, high = model.deflection
    setpoints = low + (high - low) * (0.5 + 0.6 * np.sin(np.arange(samples) / 150.0))
    ohms = np.exp(random.uniform(math.log(model.resistance.low), math.log(model.resistance.high), samples))
    answers: list[Measurement | Ended] = [healthy(k) for k in range(SETTLE)]
    answers += [healthy(SETTLE + k, float(ohm)) for k, ohm in enumerate(ohms)]
    case = Case(
        answers=answers,
        rules=replace(LOCKSTEP, rates=(math.inf,)),
        limit=CommandLimits(low=3.68, high=7.5, safe=3.68, slew_per_s=200.0),
        setpoints=setpoints.tolist(),
        delay=1,
        changes=(
            ("controller.kp", 0.05),
            ("controller.ki", 20.0),
            ("controller.ki", -1.0),
            ("setpoint", 30.0),
            ("setpoint", math.nan),
        ),
        model=model,
        forward=forward,
    )
    found = same_both_ways(case)
    assert (found.outcome.fault, len(found.rows)) == (None, samples)
    assert len(found.events) == 6


def test_a_reading_that_stands_while_the_model_s_moves_is_stuck_both_ways(identified: object) -> None:
    """The set-point steps after 100 samples of a cold film."""
    model = identified("vo2_a").model  # type: ignore[operator]
    low, high = model.deflection
    cold = model.resistance.high
    answers: list[Measurement | Ended] = [healthy(k, cold + min(k, 1)) for k in range(SETTLE + 400)]
    case = Case(
        answers=answers,
        rules=replace(LOCKSTEP, rates=(math.inf,), frozen_after=20, frozen_travel=math.inf),
        limit=CommandLimits(low=3.68, high=7.5, safe=3.68),
        setpoints=[low if k < 100 else low + 0.6 * (high - low) for k in range(400)],
        model=model,
    )
    found = same_both_ways(case)
    assert found.outcome.fault is Fault.FROZEN_VALUE
    assert "while the model's reading changed by" in found.outcome.message
    assert "acknowledged is current" in found.outcome.message
    case.rules = replace(case.rules or LOCKSTEP, frozen_after=0)
    assert same_both_ways(case).outcome.fault is None


def live_case(samples: int) -> Case:
    answers: list[Measurement | Ended] = [healthy(k) for k in range(SETTLE + samples)]
    return Case(answers=answers, setpoints=[5.0] * samples)


def playing_live(driver: ScriptedLine) -> LoopParts:
    """Parts of a live run in compiled blocks that plays levels without an estimate."""
    estimator, controller = NoEstimator(), PlaybackController()
    return LoopParts(
        driver=driver,
        estimator=estimator,
        controller=controller,
        limits=(LIMIT,),
        plausibility=Plausibility(sensed_low=(100.0,), sensed_high=(10e6,), names=NAMES),
        clock=MonotonicClock(),
        signals=Recorder(signal_columns(driver.profile, estimator, controller)),
        timings=Recorder(TIMING_COLUMNS),
        stop_requested=lambda: False,
        compiled=True,
    )


def test_live_the_deadlines_are_kept_or_counted() -> None:
    before_ns = time.monotonic_ns()
    found = taken(live_case(200), True, MonotonicClock(spin=TrackedSpin(2e5)))
    assert time.monotonic_ns() - before_ns >= 198_000_000
    assert found.outcome.steps + found.outcome.overruns == 200
    assert len(found.rows) == found.outcome.steps


def test_a_late_loop_catches_up_with_every_sample() -> None:
    found = taken(live_case(50), True, MonotonicClock(missed=Missed.CATCH_UP))
    assert len(found.rows) + found.outcome.overruns == 50


def test_a_signal_ends_the_sleep_and_its_handler_stops_the_run() -> None:
    """A second between two samples; the handler runs a few milliseconds after the first."""
    driver, asked = ScriptedLine([healthy(k) for k in range(SETTLE + 5)]), []
    parts = replace(playing_live(driver), stop_requested=lambda: bool(asked))
    plan = LoopPlan(period_s=1.0, setpoints=np.full(5, 5.0), settle_steps=0)
    prepare(driver)
    before = signal.signal(signal.SIGALRM, lambda *_: asked.append(time.monotonic()))
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        outcome = run_loop(parts, plan, BEFORE_FIRST)
    finally:
        signal.signal(signal.SIGALRM, before)
    assert (outcome.fault, outcome.taken_in) == (Fault.INTERRUPTED, BLOCKS)
    assert time.monotonic() - asked[0] < 0.5
    assert driver.closed_with == [(SAFE,)]


def test_periods_that_are_judged_end_the_run() -> None:
    case = live_case(20_000)
    driver = ScriptedLine(case.answers)
    parts = replace(playing_live(driver), timing=StepTiming(stop_after=1))
    plan = LoopPlan(period_s=1e-5, setpoints=np.full(20_000, 5.0), settle_steps=0)
    outcome = run_loop(parts, plan, BEFORE_FIRST)
    assert outcome.fault is Fault.DEADLINES_MISSED


def test_rows_of_a_mapped_recording_are_those_of_one_in_memory(tmp_path: Path) -> None:
    """More than a window of them, and of blocks of any length."""
    columns = [("a", ""), ("b", "")]
    mapped = MappedRecorder(tmp_path / "signals.rec", columns, {}, Keeper())
    memory, number = Recorder(columns), 0
    while number < 10_000:
        for recorder in (mapped, memory):
            at = number
            for _ in range(2):
                room = recorder.ahead(517)
                for k in range(len(room)):
                    room[k, :2] = at + k, -at
                    if room.shape[1] > 2:
                        room.view(np.int64)[k, 2] = len(recorder) + k + 1
                recorder.advance(len(room))
                at = len(recorder)
                del room
            recorder.append((float(at), 1.0))
        assert len(mapped) >= number
        number = len(memory)
    short = min(len(mapped), len(memory))
    found = mapped.close()
    assert len(found) >= 10_000
    assert found.table()["a"][:short].tolist() == [float(k) for k in range(short)]
    assert memory.table()["a"][:short].tolist() == [float(k) for k in range(short)]
