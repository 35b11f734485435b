"""The order of calls: which level an estimate belongs to, what is recorded beside what, how lateness is counted."""

from __future__ import annotations

import numpy as np
import pytest
from loop_cases import FIRST, SAFE, SETTLE, ScriptedDriver, WrittenEstimator, levels_mA, parts_of

from rtctl.controllers.playback import PlaybackController
from rtctl.loop.step import upcoming_setpoints
from rtctl.loop.supervisor import run_loop, signal_columns
from rtctl.timing.clock import Tick

PLAYED = [levels_mA(k) for k in range(10)]


class MissingClock:
    """Reaches the given deadlines only, each 0.25 ms late."""

    def __init__(self, steps: list[int]) -> None:
        self._steps = steps
        self._next = iter(steps)

    def start(self, period_s: float) -> None:
        self._next = iter(self._steps)

    def wait(self) -> Tick:
        return Tick(next(self._next), 2.5e-4)


def test_each_sample_is_one_exchange_and_one_row() -> None:
    driver, estimator = ScriptedDriver(), WrittenEstimator()
    parts, plan, signals = parts_of(driver, estimator)
    outcome = run_loop(parts, plan, FIRST)
    assert (outcome.steps, outcome.overruns, outcome.fault) == (10, 0, None)
    assert driver.commands == SETTLE * [SAFE] + PLAYED
    table = signals.table()
    assert list(table) == [
        name for name, _ in signal_columns(driver.profile, estimator, PlaybackController())
    ]
    assert table["index"].tolist() == list(range(10))
    assert table["setpoint"].tolist() == PLAYED
    assert table["current"].tolist() == PLAYED, "the level of this exchange stands beside its reading"
    assert table["resistance"].tolist() == [50e3 + SETTLE + k for k in range(10)]
    assert table["deflection"].tolist() == [10.0 + SETTLE + k for k in range(10)]
    assert table["estimate"].tolist() == 10 * [30.0]
    assert table["counter"].tolist() == [8 + SETTLE + k for k in range(10)]
    assert table["device_time"].tolist() == [1000 * (SETTLE + k) for k in range(10)]


def test_in_lockstep_a_reading_is_of_the_level_sent_with_it() -> None:
    driver, estimator = ScriptedDriver(), WrittenEstimator()
    parts, plan, _ = parts_of(driver, estimator)
    run_loop(parts, plan, FIRST)
    assert estimator.steps == [(PLAYED[k], 50e3 + SETTLE + k, 1e-3) for k in range(10)]


def test_live_a_reading_is_of_the_level_sent_before_it() -> None:
    driver, estimator = ScriptedDriver(), WrittenEstimator()
    parts, plan, _ = parts_of(driver, estimator, reading_delay=1)
    run_loop(parts, plan, FIRST)
    assert [level for level, _, _ in estimator.steps] == [SAFE, *PLAYED[:-1]]


def test_missed_periods_are_counted_and_their_time_is_told() -> None:
    driver, estimator = ScriptedDriver(), WrittenEstimator()
    parts, plan, signals = parts_of(driver, estimator, clock=MissingClock([0, 1, 2, 5, 6, 9]))
    outcome = run_loop(parts, plan, FIRST)
    assert (outcome.steps, outcome.overruns) == (6, 4)
    assert [elapsed for _, _, elapsed in estimator.steps] == pytest.approx(
        [1e-3, 1e-3, 1e-3, 3e-3, 1e-3, 3e-3]
    )
    table = signals.table()
    assert table["index"].tolist() == [0, 1, 2, 5, 6, 9]
    assert table["setpoint"].tolist() == [PLAYED[k] for k in (0, 1, 2, 5, 6, 9)], "setpoints keep their time"


def test_periods_missed_at_the_end_are_counted_too() -> None:
    parts, plan, _ = parts_of(ScriptedDriver(), clock=MissingClock([0, 1, 2, 14]))
    outcome = run_loop(parts, plan, FIRST)
    assert (outcome.steps, outcome.overruns) == (3, 7)


def test_lateness_is_recorded_in_microseconds_beside_every_step() -> None:
    parts, plan, signals = parts_of(ScriptedDriver(), clock=MissingClock(list(range(10))))
    run_loop(parts, plan, FIRST)
    timings = parts.timings.table()  # type: ignore[attr-defined]
    assert timings["lateness"].tolist() == pytest.approx(10 * [250.0])
    assert len(signals) == len(timings["lateness"])
    assert np.all(timings["round_trip"] >= 0.0)
    assert np.all(timings["compute"] > 0.0)


def test_a_controller_that_looks_ahead_gets_the_setpoint_of_then() -> None:
    """1.5 periods beyond the next sample: halfway between two setpoints; after the last one, the last."""
    setpoints = np.array([0.0, 1.0, 4.0, 9.0])
    assert upcoming_setpoints(setpoints, 1e-3, 0.0).tolist() == [1.0, 4.0, 9.0, 9.0]
    assert upcoming_setpoints(setpoints, 1e-3, 1.5e-3).tolist() == pytest.approx([6.5, 9.0, 9.0, 9.0])
