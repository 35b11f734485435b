"""A device in this process in compiled blocks: the same readings and the same device afterwards, to the bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.inprocess import InProcessDriver
from plant_sim.catalogue import bundled_plant
from plant_sim.device import SimulatedDevice
from rtctl.border.errors import Fault
from rtctl.border.kernels import background_kernel
from rtctl.border.wire.compiled_clock import AVAILABLE
from rtctl.border.wire.wire_memory import TIME_US
from rtctl.loop.compiled.support import BLOCKS
from rtctl.scenario.schema import Scenario, load_scenario
from rtctl.session.loop_setup import open_driver
from rtctl.session.open_loop import play
from rtctl.wiring import load_plant

pytestmark = pytest.mark.skipif(not AVAILABLE, reason="this machine has no compiled loop")
SAMPLES = 1500
SCENARIO = """
[scenario]
title = "unlocked"
period = "1 ms"
[limits]
low = "3.68 mA"
high = "8.49 mA"
[driver]
kind = "inprocess"
device = "vo2_a"
[clock]
unlocked = {unlocked}
[[excitation]]
kind = "levels"
levels = ["0 %", "0 %"]
hold = "1 s"
{more}
"""


def scenario(folder: Path, unlocked: bool, more: str = "") -> Scenario:
    file = folder / "scenario.toml"
    file.write_text(SCENARIO.format(unlocked=str(unlocked).lower(), more=more), encoding="utf-8")
    return load_scenario(file, [])[0]


@pytest.mark.parametrize("name", ["vo2_a", "vo2_l2p"])
def test_both_ways_leave_the_same_recording_and_the_same_device(name: str, tmp_path: Path) -> None:
    """Longer than blocks of samples and of noise; the device clamps some levels itself."""
    levels = 3.68 + 4.81 * np.random.default_rng(5).random(SAMPLES)
    found = []
    for unlocked in (False, True):
        asked = scenario(tmp_path, unlocked)
        device = SimulatedDevice(load_plant(bundled_plant(name), 7))
        device._high = (8.0,)
        driver = InProcessDriver(device)
        table, outcome, *_ = play(asked, driver, levels, open_driver(driver, asked), lambda: False)
        assert (outcome.fault, outcome.taken_in == BLOCKS) == (None, unlocked)
        after = device.memory()._replace(epoch_s=0.0)
        found.append(({key: values.tobytes() for key, values in table.items()}, after, device.read()))
        clamped = table["device_status"].astype(int) & 4
    assert found[0] == found[1]
    assert 0 < np.count_nonzero(clamped) < SAMPLES


def test_asked_faster_than_its_clock_counts_it_takes_a_microsecond_a_reading(tmp_path: Path) -> None:
    """A compiled loop that catches up asks again at once; the time of two readings must not be the same."""
    device = SimulatedDevice(load_plant(bundled_plant("vo2_a"), 7))
    device.set_enable(True)
    exchange = device.compiled_exchange()
    assert exchange is not None
    exchange.memory.levels[0] = 5.0
    exchange.lend()
    assert ask_often(exchange.function, *exchange.memory, 900) == 900


@background_kernel
def ask_often(function: Any, levels: Any, reading: Any, line: Any, out: Any, inbox: Any, times: int) -> int:
    later = 0
    for _ in range(times):
        before_us = line[TIME_US]
        function(levels, reading, line, out, inbox)
        later += line[TIME_US] > before_us
    return later


def test_live_it_keeps_the_machines_time(tmp_path: Path) -> None:
    asked = scenario(tmp_path, True, "").model_copy()
    asked = asked.model_copy(
        update={"clock": asked.clock.model_copy(update={"mode": "live", "settle_s": 0.0})}
    )
    device = SimulatedDevice(load_plant(bundled_plant("vo2_a"), 7))
    driver = InProcessDriver(device)
    table, outcome, *_ = play(asked, driver, np.full(600, 5.0), open_driver(driver, asked), lambda: False)
    assert outcome.taken_in == BLOCKS
    assert outcome.fault in (None, Fault.WATCHDOG_TRIPPED), "a stalled machine trips it"
    assert len(table["index"]) == outcome.steps
    time_us = table["device_time"]
    assert np.all(np.diff(time_us) > 0.0)
    assert np.all(np.diff(table["counter"]) == 1.0)
    if outcome.fault is None:
        assert time_us[-1] - time_us[0] == pytest.approx(
            1e3 * (table["index"][-1] - table["index"][0]), abs=1e5
        )
