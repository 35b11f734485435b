"""Set-point and gains change between two exchanges, through one channel, without a bump, and the events say so."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from loop_cases import FIRST, SAFE, ScriptedDriver, WrittenEstimator, parts_of

from rtctl.border.errors import Fault, InputError
from rtctl.border.records import Measurement
from rtctl.controllers.pi import NoFeedforward, PiController, PiGains
from rtctl.loop.events import START, Events, append_to, read_events
from rtctl.loop.live_parameters import ParameterChannel
from rtctl.loop.supervisor import LoopPlan, run_loop


class AskingDriver(ScriptedDriver):
    """Offers changes while given exchanges are under way."""

    def __init__(self, changes: ParameterChannel, at: dict[int, list[tuple[str, float]]]) -> None:
        super().__init__()
        self._changes, self._at = changes, at

    def exchange(self, levels: tuple[float, ...]) -> Measurement:  # type: ignore[override]
        for name, value in self._at.get(len(self.commands), []):
            self._changes.offer(name, value)
        return super().exchange(levels)


def run(
    at: dict[int, list[tuple[str, float]]], deadband: float = 0.0
) -> tuple[list[float], Events, ParameterChannel]:
    changes = ParameterChannel()
    driver = AskingDriver(changes, at)
    pi = PiController(PiGains(kp=0.1, ki=1.0), NoFeedforward(), deadband=deadband)
    parts, plan, signals = parts_of(driver, WrittenEstimator(), pi, settle=0, samples=40)
    plan = LoopPlan(period_s=1e-3, setpoints=0.0 * plan.setpoints + 31.0, settle_steps=0)
    outcome = run_loop(replace(parts, changes=changes), plan, FIRST)
    assert outcome.fault is None
    return signals.table()["current"].tolist(), parts.events, changes


def test_a_new_gain_does_not_bump_the_command() -> None:
    plain, _, _ = run({})
    changed, events, _ = run({10: [("controller.kp", 0.5)], 20: [("controller.ki", 2.0)]})
    assert changed[:21] == pytest.approx(plain[:21], abs=1e-12), (
        "the error stands still, so must the sum of the terms"
    )
    assert changed[39] - changed[21] == pytest.approx(2.0 * (plain[39] - plain[21]))
    assert [(event.step, event.kind, event.values) for event in events.noted[1:]] == [
        (10, "change", {"name": "controller.kp", "value": 0.5}),
        (20, "change", {"name": "controller.ki", "value": 2.0}),
    ]


def test_a_set_point_is_taken_and_given_back_to_the_plan() -> None:
    current, events, _ = run({10: [("setpoint", 32.0)], 20: [("setpoint", math.nan)]})
    steps = [after - before for before, after in zip(current, current[1:], strict=False)]
    assert steps[5:10] == pytest.approx(5 * [1e-3]), "ki times an error of 1 um"
    assert steps[10:20] == pytest.approx([0.1 + 2e-3] + 9 * [2e-3]), "kp and ki times 2 um, from sample 10 on"
    assert steps[20:25] == pytest.approx([-0.1 + 1e-3] + 4 * [1e-3])
    assert math.isnan(events.noted[-1].values["value"])


def test_a_flood_of_changes_costs_one_a_step() -> None:
    _, events, changes = run({5: [("setpoint", 30.0 + k / 10) for k in range(100)]})
    assert [event.step for event in events.noted[1:]] == list(range(5, 40))
    assert changes


@pytest.mark.parametrize(
    ("name", "value", "words"), [("controller.kq", 1.0, "did you mean"), ("controller.ki", -1.0, "ki > 0")]
)
def test_what_cannot_be_changed_is_refused_and_the_loop_goes_on(name: str, value: float, words: str) -> None:
    plain, _, _ = run({})
    current, events, _ = run({5: [(name, value)]})
    assert current == plain
    assert events.noted[-1].kind == "refused"
    assert words in str(events.noted[-1].values["message"])


class StoppingDriver(ScriptedDriver):
    """Asks the run to stop while a given exchange is under way, behind other changes that wait."""

    def __init__(self, changes: ParameterChannel, at: int) -> None:
        super().__init__()
        self._changes, self._at = changes, at

    def exchange(self, levels: tuple[float, ...]) -> Measurement:  # type: ignore[override]
        if len(self.commands) == self._at:
            for _ in range(5):
                self._changes.offer("setpoint", 30.0)
            self._changes.stop()
        return super().exchange(levels)


@pytest.mark.parametrize(("settle", "at", "rows"), [(0, 10, 10), (6, 2, 0)])
def test_stop_ends_the_run_at_the_safe_levels_before_all_that_waits(settle: int, at: int, rows: int) -> None:
    changes = ParameterChannel()
    driver = StoppingDriver(changes, at)
    pi = PiController(PiGains(kp=0.1, ki=1.0), NoFeedforward(), deadband=0.0)
    parts, plan, signals = parts_of(driver, WrittenEstimator(), pi, settle=settle, samples=40)
    outcome = run_loop(replace(parts, changes=changes), plan, FIRST)
    assert outcome.fault is Fault.INTERRUPTED
    assert "stopped from outside" in outcome.message
    assert driver.closed_with == [(SAFE,)]
    assert (len(driver.commands), len(signals)) == (at + 1, rows), "not one more exchange"
    assert [event.kind for event in parts.events.noted if event.kind == "change"] == []


def test_a_gain_that_is_no_number_is_not_even_offered() -> None:
    with pytest.raises(InputError, match="a finite number is needed"):
        ParameterChannel().offer("controller.kp", math.nan)


def test_a_start_is_on_the_disk_before_the_first_row_and_other_events_do_not_wait(tmp_path: Path) -> None:
    """A run that was killed within its first milliseconds had rows without a start: no replay."""
    path, threads = tmp_path / "events.jsonl", list[threading.Timer]()

    def later(work: Callable[[], None]) -> None:
        threads.append(threading.Timer(0.05, work))
        threads[-1].start()

    events = Events(append_to(path, later))
    events.note(0, START, sensed=(1.0,), levels=(3.68,))
    assert [one.kind for one in read_events(path)] == [START]
    events.note(7, "change", name="setpoint", value=1.0)
    assert len(list(read_events(path))) == 1
    for one in threads:
        one.join()
    assert len(list(read_events(path))) == 2


def test_events_read_back_to_the_bit_and_a_line_cut_off_ends_them(tmp_path: Path) -> None:
    path = tmp_path / "events.jsonl"
    events = Events(append_to(path, lambda work: work()))
    events.note(0, "start", sensed=(0.1 + 0.2, math.nan), levels=(3.68,))
    events.note(7, "change", name="setpoint", value=math.inf)
    with path.open("a") as file:
        file.write('{"step": 9, "ev')
    first, second = read_events(path)
    assert first.values["sensed"][0] == 0.1 + 0.2
    assert math.isnan(first.values["sensed"][1])
    assert second == (7, "change", {"name": "setpoint", "value": math.inf})
