"""What a loop leaves behind: heat that no new start forgets, no armed device, and a true word of both."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from loop_cases import FIRST, SAFE, SETTLE, Change, ScriptedDriver, WrittenEstimator, parts_of

from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.border.records import Measurement, SwitchedOff
from rtctl.controllers.pi import NoFeedforward, PiController, PiGains
from rtctl.loop.live_parameters import Change as ParameterChange
from rtctl.loop.supervisor import run_loop
from rtctl.safety.guards import EnergyGuard
from rtctl.safety.limits import CommandLimits
from rtctl.session.loop_setup import closed_on_error

WINDOW_S, PERIOD_S, OFF_S = 0.05, 1e-3, 5e-3
LIMITS = CommandLimits(low=SAFE, high=9.0, safe=SAFE, rms=3.0, rms_window_s=WINDOW_S)


class Ending(ScriptedDriver):
    """Says what it acknowledged of being switched off, and can be opened again."""

    def __init__(
        self, says: SwitchedOff | None, script: dict[int, Change | BaseException] | None = None
    ) -> None:
        super().__init__(script)
        self._says = says

    def close(self, safe_levels: Sequence[float]) -> SwitchedOff | None:  # type: ignore[override]
        super().close(safe_levels)
        return self._says

    def reopen(self) -> Measurement:
        return FIRST._replace(counter=7 + len(self.commands))


@pytest.mark.parametrize("says", [SwitchedOff.OFF, SwitchedOff.SILENT])
def test_a_device_that_is_armed_again_is_as_warm_as_it_was(says: SwitchedOff) -> None:
    """Each fault would allow the whole of the energy once more; off, it may be at the last command."""
    faults = {SETTLE + 4 + k * (2 * SETTLE + 3): DriverError(Fault.NO_ANSWER, "silence") for k in range(5)}
    driver = Ending(says, faults)
    parts, plan, _ = parts_of(driver, samples=200)
    parts = replace(
        parts, limits=(LIMITS,), energy=EnergyGuard((LIMITS,), ["current [mA]"]), reopen=driver.reopen
    )
    outcome = run_loop(parts, replace(plan, rearm_times=5, rearm_after_s=OFF_S), FIRST)
    assert outcome.fault is Fault.ENERGY_LIMIT
    assert outcome.survived
    square, highest = SAFE**2, 0.0
    for number, level in enumerate(driver.commands):
        square = level**2 + (square - level**2) * math.exp(-PERIOD_S / WINDOW_S)
        highest = max(highest, square if level > SAFE else 0.0)
        if number in faults and number != len(driver.commands) - 1:
            held = SAFE if says is SwitchedOff.OFF else level
            square = held**2 + (square - held**2) * math.exp(-OFF_S / WINDOW_S)
    assert math.sqrt(highest) <= LIMITS.rms * (1.0 + 1e-9)


@pytest.mark.parametrize(
    ("says", "words"),
    [
        (SwitchedOff.SAFE, "the last command that the device acknowledged is the safe one"),
        (SwitchedOff.SILENT, "switch it off by hand"),
        (SwitchedOff.OFF, ""),
        (None, ""),
    ],
)
def test_the_end_of_a_run_says_what_the_device_acknowledged(
    says: SwitchedOff | None, words: str, caplog: pytest.LogCaptureFixture
) -> None:
    parts, plan, _ = parts_of(Ending(says))
    with caplog.at_level(logging.WARNING, logger="rtctl"):
        run_loop(parts, plan, FIRST)
    assert words in caplog.text
    assert bool(caplog.text) == bool(words)


@pytest.mark.parametrize("error", [InputError("no"), ValueError("a bug"), KeyboardInterrupt()])
def test_whatever_ends_the_preparation_closes_the_device(error: BaseException) -> None:
    driver = ScriptedDriver()
    with pytest.raises(type(error)), closed_on_error(driver, (SAFE,)):
        raise error
    assert driver.closed_with == [(SAFE,)]
    with closed_on_error(driver, (SAFE,)):
        pass
    assert driver.closed_with == [(SAFE,)]


def test_a_change_that_the_loop_refuses_is_told_to_its_judge() -> None:
    pi = PiController(PiGains(kp=0.1, ki=1.0), NoFeedforward(), deadband=0.0)
    parts, plan, _ = parts_of(ScriptedDriver(), WrittenEstimator(), pi, settle=0, samples=20)
    told: list[ParameterChange] = []
    parts.changes.refuse = told.append
    parts.changes.offer("controller.ki", -1.0)
    outcome = run_loop(parts, replace(plan, setpoints=np.full(20, 31.0)), FIRST)
    assert outcome.fault is None
    assert told == [("controller.ki", -1.0)]
