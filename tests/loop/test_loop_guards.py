"""Each lie of a device and each excess of a controller has its name, and the next command is the safe one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from loop_cases import FIRST, SAFE, SETTLE, Change, ScriptedDriver, levels_mA, parts_of

from rtctl.border.errors import DriverError, Fault
from rtctl.border.records import VO2, DeviceStatus, Measurement
from rtctl.loop.supervisor import LoopParts, LoopPlan, run_loop
from rtctl.safety.guards import EnergyGuard, ReadingGuard, ReadingRules
from rtctl.safety.limits import CommandLimits
from rtctl.scenario.schema import load_scenario
from rtctl.wiring import build_guard

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"
NAMES = ("resistance [ohm]",)
ENABLED = int(DeviceStatus.ENABLED)
LOCKSTEP = ReadingRules(names=NAMES, rates=(math.inf,), lockstep_us=1000)
LIVE = ReadingRules(names=NAMES, rates=(math.inf,))
MS = 1_000_000
BEFORE_FIRST = FIRST._replace(time_us=(-1000) & 0xFFFFFFFF)
"""One sample before what a scripted driver answers first."""


def guarded(driver: ScriptedDriver, rules: ReadingRules, **changes: object) -> tuple[LoopParts, LoopPlan]:
    parts, plan, _ = parts_of(driver)
    return replace(parts, guard=ReadingGuard(rules), **changes), plan  # type: ignore[arg-type]


CASES: dict[str, tuple[ReadingRules, Change, Fault, str]] = {
    "too fast": (
        replace(LOCKSTEP, rates=(5e3,)),
        lambda healthy: healthy._replace(sensed=(50_020.0,)),
        Fault.RATE,
        "limits.sensed_rate",
    ),
    "counter jumps": (
        LOCKSTEP,
        lambda healthy: healthy._replace(counter=healthy.counter + 1),
        Fault.COUNTER_JUMP,
        "went on by 2, until now each command advanced it by 1",
    ),
    "device time stands": (
        LOCKSTEP,
        lambda healthy: healthy._replace(time_us=healthy.time_us - 1000),
        Fault.DEVICE_TIME,
        "advanced the device's time by 0 us, its sample period is 1000 us",
    ),
    "device time jumps": (
        LOCKSTEP,
        lambda healthy: healthy._replace(time_us=healthy.time_us + 500),
        Fault.DEVICE_TIME,
        "by 1500 us",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_a_device_that_lies_is_left_at_the_safe_level_within_one_period(case: str) -> None:
    rules, change, fault, words = CASES[case]
    driver = ScriptedDriver({SETTLE + 6: change})
    parts, plan = guarded(driver, rules)
    outcome = run_loop(parts, plan, BEFORE_FIRST)
    assert (outcome.fault, outcome.steps) == (fault, 6)
    assert words in outcome.message
    assert driver.commands == SETTLE * [SAFE] + [levels_mA(k) for k in range(7)]
    assert driver.closed_with == [(SAFE,)]


def test_a_healthy_device_passes_all_checks() -> None:
    driver = ScriptedDriver()
    parts, plan = guarded(driver, replace(LOCKSTEP, rates=(1e6,), frozen_after=3, frozen_travel=0.01))
    assert run_loop(parts, plan, BEFORE_FIRST).fault is None


def stuck(healthy: Measurement) -> Measurement:
    return healthy._replace(sensed=(50_000.5,))


def barely_moved(healthy: Measurement) -> Measurement:
    """The reading before, 1 mohm off: so fine is the instrument."""
    return healthy._replace(sensed=(healthy.sensed[0] - 0.999,))


def test_a_stuck_sensor_is_found_once_the_command_has_moved() -> None:
    driver = ScriptedDriver({SETTLE: barely_moved, **{SETTLE + k: stuck for k in range(2, 10)}})
    rules = replace(LOCKSTEP, frozen_after=3, frozen_travel=0.15)
    parts, plan = guarded(driver, rules)
    outcome = run_loop(parts, plan, BEFORE_FIRST)
    assert outcome.fault is Fault.FROZEN_VALUE
    assert outcome.steps == 5, "samples 3, 4 and 5 repeat sample 2, and the command has moved by 0.2 mA"
    assert "4 times in a row while the command moved by" in outcome.message
    assert "--set safety.frozen_after=0" in outcome.message


def film(level: float) -> float:
    """Resistance [ohm] at 15 ohm of resolution: a transition about 6 mA, above it a metallic plateau."""
    return 15.0 * round((11_000.0 + 150_000.0 / (1.0 + math.exp((level - 6.0) / 0.3))) / 15.0)


VO2_RULES = replace(LIVE, frozen_after=20, frozen_travel=0.5, plateau_travel=5.0, timed=False)
"""20 repetitions, 5 % and half of 0 to 10 mA."""


def first_finding(
    levels: np.ndarray, readings: list[float], rules: ReadingRules = VO2_RULES
) -> tuple[int, str] | None:
    """Index and words of the first finding of the guard of a vo2 device."""
    guard = ReadingGuard(rules)
    before = Measurement((readings[0],), 1.0, 0, 0, 0, ENABLED)
    for k, (level, reading) in enumerate(zip(levels[1:], readings[1:], strict=True), start=1):
        new = before._replace(sensed=(reading,), counter=k, time_us=1000 * k, sequence=k)
        found = guard.judge(new, before, float(level), 1e-3, k * MS, k * MS)
        if found:
            assert found[0] is Fault.FROZEN_VALUE
            return k, found[1]
        before = new
    return None


RAMP = np.concatenate((np.linspace(3.0, 10.0, 700), np.linspace(10.0, 7.5, 250)))


def test_a_metallic_film_that_reads_the_same_for_long_is_not_stuck() -> None:
    readings = [film(level) for level in RAMP]
    assert len(set(readings[640:760])) <= 2, "more than a hundred equal readings over 0.6 mA"
    assert first_finding(RAMP, readings) is None


def test_a_plateau_that_begins_with_the_last_domain_of_a_film_is_no_stuck_sensor() -> None:
    def coarse(level: float) -> float:
        left = int((np.linspace(5.0, 7.0, 30) > level).sum())
        return 15_405.0 + 4_500.0 * left - 15.0 * round(4.0 * level) * (left > 0)

    readings = [coarse(level) for level in RAMP]
    assert first_finding(RAMP, readings) is None


def test_a_film_that_has_not_answered_a_jump_yet_is_no_stuck_sensor() -> None:
    levels = np.concatenate((np.linspace(3.0, 10.0, 700), np.full(30, 10.0), np.full(30, 3.0)))
    readings = [film(level) for level in levels[:730]] + [film(10.0)] * 8 + [film(3.0)] * 22
    assert first_finding(levels, readings) is None


@pytest.mark.parametrize(("name", "found"), [("acquire_vo2", False), ("steps", True)])
def test_in_open_loop_a_reading_that_repeats_after_a_reversal_is_no_stuck_sensor(
    name: str, found: bool
) -> None:
    """A loop of 1 mA of width, read in steps of 15 ohm: nothing switches until it is crossed."""
    turns = [np.linspace(a, b, 400) for a, b in ((3.7, 8.0), (8.0, 5.2), (5.2, 6.1))]
    levels, play = np.concatenate(turns), 3.7
    readings = []
    for level in levels:
        play = max(level, min(play, level + 1.0))
        readings.append(film(play))
    scenario, _ = load_scenario(SCENARIOS / f"{name}.toml", [])
    rules = replace(build_guard(scenario, VO2).rules, timed=False)
    assert (first_finding(levels, readings, rules) is not None) is found


@pytest.mark.parametrize(
    ("from_sample", "within"),
    [(1060, 60), (1120, 60), (700, 600), (300, 1000)],
    ids=["slope", "slope further on", "plateau", "where no reading was before"],
)
def test_a_sensor_that_sticks_is_found_on_a_slope_at_once_and_on_a_plateau_after_half_the_range(
    from_sample: int, within: int
) -> None:
    levels = np.concatenate((RAMP, np.linspace(7.5, 2.0, 550)))
    readings = [film(level) for level in levels]
    readings[from_sample:] = [readings[from_sample]] * (len(readings) - from_sample)
    found = first_finding(levels, readings)
    assert found is not None
    assert from_sample + 19 < found[0] <= from_sample + within
    assert "times in a row while the command moved by" in found[1]


def test_a_sensor_that_never_moved_is_found_though_its_resolution_is_not_known() -> None:
    assert first_finding(RAMP, [11_190.0] * len(RAMP)) is not None


def test_equal_readings_at_rest_are_no_stuck_sensor() -> None:
    driver = ScriptedDriver(dict.fromkeys(range(SETTLE), stuck))
    parts, plan = guarded(driver, replace(LOCKSTEP, frozen_after=1, frozen_travel=0.01))
    assert run_loop(parts, plan, BEFORE_FIRST).fault is None


def judged_live(
    device_us: Callable[[int], float], steps: int = 3000, delay_ns: Callable[[int], int] = lambda k: 0
) -> tuple[int, Fault] | None:
    """The first finding of a device asked every millisecond whose clock reads `device_us` at `k` ms."""
    guard = ReadingGuard(LIVE)
    guard.start()
    before = Measurement((1e4,), 1.0, 0, round(device_us(0)) & 0xFFFFFFFF, 0, ENABLED)
    for k in range(1, steps):
        new = before._replace(
            sensed=(1e4 + k,), counter=k, time_us=round(device_us(k)) & 0xFFFFFFFF, sequence=k
        )
        found = guard.judge(new, before, 5.0, 1e-3, k * MS, k * MS + 200_000 + delay_ns(k))
        if found:
            return k, found[0]
        before = new
    return None


def test_a_device_s_clock_that_keeps_time_is_believed_through_its_wrap() -> None:
    assert judged_live(lambda k: 0xFFFFFFFF - 1_500_000 + 1000 * k) is None
    assert judged_live(lambda k: 1010 * k) is None, "one percent off, as a bad oscillator is"


def test_a_host_that_stalls_is_not_taken_for_a_device_that_runs_off() -> None:
    stall = lambda k: 400 * MS if k == 1500 else 0  # noqa: E731
    assert judged_live(lambda k: 1000 * k, delay_ns=stall) is None


@pytest.mark.parametrize("rate", [0.9, 1.1])
def test_a_device_s_clock_that_runs_off_is_found_within_a_second(rate: float) -> None:
    found = judged_live(lambda k: 1000 * k if k < 1000 else 1_000_000 + rate * 1000 * (k - 1000))
    assert found is not None
    assert found[1] is Fault.DEVICE_TIME
    assert 1000 < found[0] <= 2000


@pytest.mark.parametrize("jump_us", [-200_000, 30_000 + 55_000])
def test_a_device_s_clock_that_jumps_is_found_at_once(jump_us: int) -> None:
    found = judged_live(lambda k: 10_000_000 + 1000 * k + (jump_us if k >= 700 else 0))
    assert found == (700, Fault.DEVICE_TIME)


def test_a_device_s_clock_that_stands_is_found_at_once() -> None:
    assert judged_live(lambda k: 1000 * min(k, 50)) == (51, Fault.DEVICE_TIME)


def test_a_counter_faster_than_any_instrument_has_jumped() -> None:
    guard = ReadingGuard(LIVE)
    guard.start()
    before = Measurement((1e4,), 1.0, 7, 0, 0, ENABLED)
    new = before._replace(sensed=(2e4,), counter=5000, time_us=1000)
    found = guard.judge(new, before, 5.0, 1e-3, 0, 1000)
    assert found is not None
    assert found[0] is Fault.COUNTER_JUMP


def test_energy_is_found_before_it_is_put_in() -> None:
    """5 mA after rest at 1 mA over 0.1 s reaches 4 mA rms when 1 - exp(-t / 0.1) = 15 / 24."""
    limits = (CommandLimits(low=1.0, high=9.0, safe=1.0, rms=4.0, rms_window_s=0.1),)
    guard = EnergyGuard(limits, ["current [mA]"])
    guard.start((1.0,))
    for _ in range(math.floor(-100.0 * math.log(1 - 15 / 24))):
        guard.refuse_too_much((5.0,), 1e-3)
    with pytest.raises(DriverError, match="rms") as caught:
        guard.refuse_too_much((5.0,), 1e-3)
    assert caught.value.fault is Fault.ENERGY_LIMIT


def test_a_loop_that_puts_in_too_much_ends_with_the_command_unsent() -> None:
    driver = ScriptedDriver()
    limits = (CommandLimits(low=SAFE, high=9.0, safe=SAFE, rms=3.0, rms_window_s=5e-3),)
    parts, plan, _ = parts_of(driver)
    parts = replace(parts, limits=limits, energy=EnergyGuard(limits, ["current [mA]"]))
    outcome = run_loop(parts, plan, FIRST)
    assert outcome.fault is Fault.ENERGY_LIMIT
    sent = np.array(driver.commands[SETTLE:])
    mean = SAFE**2
    for level in sent:
        mean = level**2 + (mean - level**2) * math.exp(-0.2)
        assert math.sqrt(mean) <= 3.0
    assert len(sent) < 10
    assert driver.closed_with == [(SAFE,)]


@pytest.mark.parametrize(
    ("asked", "before", "fault"), [(9.5, 5.0, Fault.LEVEL_LIMIT), (5.5, 5.0, Fault.SLEW_LIMIT)]
)
def test_with_stop_a_controller_that_asks_for_too_much_is_not_obeyed_in_part(
    asked: float, before: float, fault: Fault
) -> None:
    limits = CommandLimits(low=SAFE, high=9.0, safe=SAFE, slew_per_s=100.0, stop=True)
    assert limits.clip(5.05, 5.0, 1e-3) == 5.05
    with pytest.raises(DriverError, match=r"limits\.stop is set") as caught:
        limits.clip(asked, before, 1e-3)
    assert caught.value.fault is fault


class ReopenedDriver(ScriptedDriver):
    """Counts how often it was opened."""

    def __init__(self, script: dict[int, Change | BaseException]) -> None:
        super().__init__(script)
        self.opened = 0

    def reopen(self) -> Measurement:
        self.opened += 1
        return FIRST._replace(counter=7 + len(self.commands))


def test_after_a_fault_the_device_is_armed_again_and_the_plan_goes_on_where_it_was() -> None:
    nan: Change = lambda healthy: healthy._replace(sensed=(math.nan,))  # noqa: E731
    driver = ReopenedDriver({SETTLE + 4: nan})
    parts, plan, signals = parts_of(driver)
    parts = replace(parts, reopen=driver.reopen)
    outcome = run_loop(parts, replace(plan, rearm_times=1, rearm_after_s=0.01), FIRST)
    assert (outcome.fault, outcome.steps, driver.opened) == (None, 10, 1)
    assert [(step, fault) for step, fault, _ in outcome.survived] == [(4, Fault.NOT_FINITE)]
    assert driver.closed_with == [(SAFE,), (SAFE,)], "safe after the fault, and at the end"
    played = [levels_mA(k) for k in range(10)]
    assert driver.commands == SETTLE * [SAFE] + played[:5] + SETTLE * [SAFE] + played[4:]
    assert signals.table()["index"].tolist() == list(range(10))
    assert [event.kind for event in parts.events.noted] == ["start", "fault", "rearmed", "start"]
    assert [event.step for event in parts.events.noted] == [0, 4, 4, 4]


def test_more_faults_than_allowed_end_the_run() -> None:
    gone = DriverError(Fault.NO_ANSWER, "silence")
    driver = ReopenedDriver({SETTLE + 2: gone, 2 * SETTLE + 4: gone})
    parts, plan, _ = parts_of(driver)
    outcome = run_loop(replace(parts, reopen=driver.reopen), replace(plan, rearm_times=1), FIRST)
    assert (outcome.fault, len(outcome.survived), driver.opened) == (Fault.NO_ANSWER, 1, 1)


def test_a_stop_by_the_user_is_no_fault_to_recover_from() -> None:
    driver = ReopenedDriver({})
    parts, plan, _ = parts_of(driver, stop_requested=lambda: len(driver.commands) == SETTLE + 5)
    outcome = run_loop(replace(parts, reopen=driver.reopen), replace(plan, rearm_times=5), FIRST)
    assert (outcome.fault, driver.opened) == (Fault.INTERRUPTED, 0)
