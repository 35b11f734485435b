"""A running loop as an instrument, also of other programs: read from its recording, changed by its control socket."""

from __future__ import annotations

import math
import threading
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

import rtctl
from rtctl.as_instrument.running_loop import RunningLoop
from rtctl.border.errors import InputError

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::FutureWarning")

MODEL = """
[model]
kind = "equations"
[model.inputs]
u = { unit = "V" }
[model.states]
x = { unit = "mm", rate = "(k*u - x)/tau", initial = 0.0 }
[model.outputs]
y = { unit = "mm", value = "x" }
[model.parameters]
k = { value = 2.0, unit = "mm/V" }
tau = { value = 0.1, unit = "s" }
[device.outputs.y]
low = -10.0
high = 10.0
"""
SCENARIO = """
[scenario]
title = "a slow actuator"
plant = "equations"
model = "model.toml"
period = "20 ms"
duration = "60 s"
[clock]
mode = "live"
timeout = "5 s"
watchdog = "10 s"
[limits]
low = "-5 V"
high = "5 V"
safe = "0 V"
[reference]
kind = "steps"
levels = ["1 mm"]
hold = "60 s"
[estimator]
kind = "none"
[controller]
kind = "pid"
"""


class Running(NamedTuple):
    """A run under way, and how many rows it had at a moment."""

    folder: Path
    outcome: list[Any]
    thread: threading.Thread

    def wait_for(self, loop: RunningLoop, name: str, value: float) -> None:
        """Until a signal has come to `value`; the loop takes 50 samples a second."""
        waited = threading.Event()
        for _ in range(1000):
            if abs(loop.read(name) - value) < 1e-3 * max(abs(value), 1.0):
                return
            waited.wait(0.01)
        raise AssertionError(f"{name} is {loop.read(name)}, {value} never came")


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A loop at 50 Hz in a thread of the tests, until it is stopped."""
    folder = tmp_path_factory.mktemp("loop")
    (folder / "model.toml").write_text(MODEL, encoding="utf-8")
    (folder / "run.toml").write_text(SCENARIO, encoding="utf-8")
    out, outcome = folder / "out", []
    thread = threading.Thread(target=lambda: outcome.append(rtctl.run(folder / "run.toml", out=out)))
    thread.start()
    started = threading.Event()
    for _ in range(3000):
        if not thread.is_alive() or _has_rows(out):
            break
        started.wait(0.01)
    made = Running(out, outcome, thread)
    yield made
    if thread.is_alive():
        RunningLoop(out).stop()
    thread.join(20.0)
    assert not thread.is_alive()


def _has_rows(folder: Path) -> bool:
    try:
        return RunningLoop(folder).read("index") >= 0.0
    except InputError:
        return False


def imported(name: str) -> Any:
    """A module of others, whose own warnings are not ours."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip(name, exc_type=ImportError)


def test_signals_are_read_and_set_point_and_gains_are_set(running: Running) -> None:
    loop = RunningLoop(running.folder)
    assert loop.signals["setpoint"] == "mm"
    assert set(loop.gains()) == {"controller.kp", "controller.ki", "controller.kd"}
    running.wait_for(loop, "estimate", 1.0)
    loop.change("setpoint", 2.0)
    running.wait_for(loop, "setpoint", 2.0)
    running.wait_for(loop, "estimate", 2.0)
    before = loop.read("controller.kp")
    loop.change("controller.kp", 0.5 * before)
    assert loop.read("controller.kp") == pytest.approx(0.5 * before)
    loop.change("setpoint", math.nan)
    running.wait_for(loop, "setpoint", 1.0)
    loop.close()


def test_what_cannot_be_is_told(running: Running, tmp_path: Path) -> None:
    loop = RunningLoop(running.folder)
    with pytest.raises(InputError, match='the run has no "estimat"; did you mean "estimate"'):
        loop.read("estimat")
    with pytest.raises(InputError, match="estimate: is only read; the set-point and the gains can be set"):
        loop.change("estimate", 1.0)
    with pytest.raises(InputError, match="no run is under way here"):
        RunningLoop(tmp_path)
    loop.close()


def test_qcodes_reads_and_sets(running: Running) -> None:
    imported("qcodes.instrument")
    from rtctl.as_instrument.qcodes import LoopInstrument

    instrument = LoopInstrument("loop", running.folder)
    try:
        assert instrument.setpoint.unit == "mm"
        assert math.isfinite(instrument.estimate())
        instrument.setpoint(1.5)
        running.wait_for(instrument.loop, "setpoint", 1.5)
        instrument.ki(0.9 * instrument.ki())
        with pytest.raises(NotImplementedError):
            instrument.estimate(1.0)
        assert instrument.get_idn()["vendor"] == "rtctl"
        assert instrument.snapshot()["parameters"]["setpoint"]["unit"] == "mm"
    finally:
        instrument.close()


def test_pymeasure_reads_and_sets(running: Running) -> None:
    imported("pymeasure.instruments")
    from rtctl.as_instrument.pymeasure import LoopAdapter, LoopInstrument

    instrument = LoopInstrument(LoopAdapter(running.folder))
    instrument.setpoint = 0.75
    running.wait_for(instrument.adapter.loop, "setpoint", 0.75)
    assert instrument.setpoint == 0.75
    assert math.isfinite(instrument.estimate)
    kp = instrument.kp
    instrument.kp = kp / 3.0
    assert instrument.kp == pytest.approx(kp / 3.0, rel=1e-11)
    assert instrument.signal("y") == pytest.approx(instrument.estimate, abs=1.0)
    instrument.follow_plan()
    running.wait_for(instrument.adapter.loop, "setpoint", 1.0)
    with pytest.raises(InputError, match="expected NAME VALUE, such as setpoint 30"):
        instrument.write("setpoint")
    instrument.adapter.close()


def test_stop_ends_the_run(running: Running) -> None:
    loop = RunningLoop(running.folder)
    loop.stop()
    running.thread.join(20.0)
    assert not running.thread.is_alive()
    (run,) = running.outcome
    assert run.fault == "interrupted"
    loop.close()
