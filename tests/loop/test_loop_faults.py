"""Whatever goes wrong: the very next command is the safe one, the fault has its name, nothing recorded is lost."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest
from loop_cases import FIRST, SAFE, SETTLE, Change, ScriptedDriver, WrittenEstimator, levels_mA, parts_of

from rtctl.border.errors import DriverError, Fault
from rtctl.border.records import DeviceStatus, Measurement
from rtctl.controllers.pi import NoFeedforward, PiController, PiGains
from rtctl.interfaces import ControlAction, Estimate
from rtctl.loop.supervisor import run_loop

ENABLED = int(DeviceStatus.ENABLED)


def sensing(value: float) -> Change:
    return lambda healthy: healthy._replace(sensed=(value,))


def with_status(status: int) -> Change:
    return lambda healthy: healthy._replace(status=status)


def standing_still(healthy: Measurement) -> Measurement:
    return healthy._replace(counter=healthy.counter - 1)


FAULTS: dict[str, tuple[Change | DriverError, Fault, str]] = {
    "nan": (sensing(math.nan), Fault.NOT_FINITE, "resistance"),
    "infinite": (sensing(math.inf), Fault.NOT_FINITE, "resistance"),
    "too low": (sensing(99.9), Fault.OUT_OF_RANGE, "99.9"),
    "too high": (sensing(1.001e7), Fault.OUT_OF_RANGE, "1.001e+07"),
    "frozen counter": (standing_still, Fault.FROZEN_COUNTER, "counter"),
    "watchdog": (with_status(ENABLED | DeviceStatus.WATCHDOG_TRIPPED), Fault.WATCHDOG_TRIPPED, "enable"),
    "sensor": (with_status(ENABLED | DeviceStatus.SENSOR_FAULT), Fault.SENSOR_FAULT, "sensor"),
    "refused": (with_status(ENABLED | DeviceStatus.REFUSED), Fault.COMMAND_REFUSED, "refused"),
    "not enabled": (with_status(0), Fault.NOT_ENABLED, "enabled"),
    "no answer": (DriverError(Fault.NO_ANSWER, "silence on ttyX"), Fault.NO_ANSWER, "silence on ttyX"),
    "stale": (DriverError(Fault.STALE_REPLY, "late reply"), Fault.STALE_REPLY, "late reply"),
}


@pytest.mark.parametrize("case", FAULTS)
@pytest.mark.parametrize("sample", [0, 6])
def test_a_fault_while_tracking_ends_at_the_safe_level(case: str, sample: int) -> None:
    change, fault, words = FAULTS[case]
    driver = ScriptedDriver({SETTLE + sample: change})
    parts, plan, signals = parts_of(driver)
    outcome = run_loop(parts, plan, FIRST)
    assert (outcome.fault, outcome.steps) == (fault, sample)
    assert words in outcome.message
    played = [levels_mA(k) for k in range(sample + 1)]
    assert driver.commands == SETTLE * [SAFE] + played, "no command follows the faulty answer"
    assert driver.closed_with == [(SAFE,)]
    assert signals.table()["current"].tolist() == played[:sample]


@pytest.mark.parametrize("case", FAULTS)
def test_a_fault_while_settling_ends_before_anything_is_tried(case: str) -> None:
    change, fault, _ = FAULTS[case]
    driver = ScriptedDriver({1: change})
    parts, plan, signals = parts_of(driver)
    outcome = run_loop(parts, plan, FIRST)
    assert (outcome.fault, outcome.steps, len(signals)) == (fault, 0, 0)
    assert driver.commands == [SAFE, SAFE]
    assert driver.closed_with == [(SAFE,)]


@pytest.mark.parametrize("case", ["nan", "too high", "sensor", "not enabled"])
def test_a_first_reading_that_is_not_believed_starts_nothing(case: str) -> None:
    change, fault, _ = FAULTS[case]
    assert not isinstance(change, DriverError)
    driver = ScriptedDriver()
    parts, plan, _ = parts_of(driver, settle=0)
    assert run_loop(parts, plan, change(FIRST)).fault is fault
    assert driver.commands == []
    assert driver.closed_with == [(SAFE,)]


def test_a_clamped_command_is_recorded_and_no_fault() -> None:
    driver = ScriptedDriver({SETTLE + 4: with_status(ENABLED | DeviceStatus.CLAMPED)})
    parts, plan, signals = parts_of(driver)
    outcome = run_loop(parts, plan, FIRST)
    assert (outcome.fault, outcome.message, outcome.steps) == (None, "", 10)
    assert signals.table()["device_status"].tolist() == 4 * [1.0] + [5.0] + 5 * [1.0]
    assert driver.closed_with == [(SAFE,)], "a whole run ends at the safe level too"


def test_asking_to_stop_ends_after_the_exchange_under_way() -> None:
    driver = ScriptedDriver()
    parts, plan, signals = parts_of(driver, stop_requested=lambda: len(driver.commands) == SETTLE + 5)
    outcome = run_loop(parts, plan, FIRST)
    assert (outcome.fault, outcome.steps, len(signals)) == (Fault.INTERRUPTED, 4, 4)
    assert driver.closed_with == [(SAFE,)]


@pytest.mark.parametrize("error", [KeyboardInterrupt(), ZeroDivisionError("a bug")])
def test_what_is_no_fault_is_passed_on_and_the_device_is_safe(error: BaseException) -> None:
    driver = ScriptedDriver()
    parts, plan, signals = parts_of(driver, WrittenEstimator(4, error))
    with pytest.raises(type(error)):
        run_loop(parts, plan, FIRST)
    assert driver.closed_with == [(SAFE,)]
    assert len(signals) == 4


class BrokenController:
    """Asks for `end` at its fifth step."""

    terms = ()
    preview_s = 0.0

    def __init__(self, end: float) -> None:
        self._end = end
        self._steps = 0

    def start(self, levels: Sequence[float], setpoint: float, estimate: Estimate) -> None:
        self._steps = 0

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        self._steps += 1
        return ControlAction((self._end if self._steps == 5 else 5.0,), ())

    def applied(self, levels: Sequence[float]) -> None:
        pass


@pytest.mark.parametrize("end", [math.nan, math.inf, -math.inf])
def test_a_command_that_is_no_number_is_a_fault_and_never_sent(end: float) -> None:
    driver = ScriptedDriver()
    parts, plan, signals = parts_of(driver, controller=BrokenController(end))
    outcome = run_loop(parts, plan, FIRST)
    assert outcome.fault is Fault.NOT_FINITE
    assert str(end) in outcome.message
    assert driver.commands == SETTLE * [SAFE] + 4 * [5.0]
    assert driver.closed_with == [(SAFE,)]
    assert len(signals) == 3


@pytest.mark.parametrize("kp", [0.0, 0.01])
def test_an_estimate_that_is_no_number_is_no_error_of_zero(kp: float) -> None:
    """A deadband must not swallow the NaN: the PI would hold its level and look content."""
    driver = ScriptedDriver()
    pi = PiController(PiGains(kp=kp, ki=1.0), NoFeedforward(), deadband=0.1)
    parts, plan, _ = parts_of(driver, WrittenEstimator(5, math.nan), pi)
    outcome = run_loop(parts, plan, FIRST)
    assert (outcome.fault, outcome.steps) == (Fault.NOT_FINITE, 5)
    assert len(driver.commands) == SETTLE + 6
    assert all(map(math.isfinite, driver.commands))
    assert driver.closed_with == [(SAFE,)]
