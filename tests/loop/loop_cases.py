"""A driver that follows a script, and parts around it, so that a test sees what the loop does with each answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from rtctl.border.records import VO2, DeviceStatus, Measurement
from rtctl.controllers.playback import PlaybackController
from rtctl.interfaces import Clock, Controller, Estimate, Estimator
from rtctl.loop.supervisor import TIMING_COLUMNS, LoopParts, LoopPlan, signal_columns
from rtctl.recording import Recorder
from rtctl.safety.limits import CommandLimits
from rtctl.safety.plausibility import Plausibility
from rtctl.timing.clock import SimulatedClock

SAFE = 1.0
SETTLE = 3
FIRST = Measurement((50e3,), 10.0, 7, 0, 0, int(DeviceStatus.ENABLED))
Change = Callable[[Measurement], Measurement]


class ScriptedDriver:
    """Healthy answers, save where `script` changes or replaces one; the exchange with index 0 is the first."""

    def __init__(self, script: Mapping[int, Change | BaseException] | None = None) -> None:
        self.profile = VO2
        self.identity = "SCRIPT"
        self.commands: list[float] = []
        self.closed_with: list[tuple[float, ...]] = []
        self._script = dict(script or {})

    def open(self, *, lockstep_period_us: int | None, watchdog_ms: int, timeout_s: float) -> Measurement:
        return FIRST

    def exchange(self, levels: Sequence[float]) -> Measurement:
        index = len(self.commands)
        self.commands.extend(levels)
        healthy = Measurement(
            (50e3 + index,), 10.0 + index, 8 + index, 1000 * index, index, int(DeviceStatus.ENABLED)
        )
        change = self._script.get(index)
        if isinstance(change, BaseException):
            raise change
        return change(healthy) if change else healthy

    def close(self, safe_levels: Sequence[float]) -> None:
        self.closed_with.append(tuple(safe_levels))


class WrittenEstimator:
    """Notes what it is told; answers 30 um until, at sample `last`, it gives `end`."""

    surrogate = ("surrogate", "mA")

    def __init__(self, last: int = -1, end: float | BaseException = 30.0) -> None:
        self.steps: list[tuple[float, float, float]] = []
        self._last, self._end = last, end

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        self.steps = []
        return Estimate(30.0, 5.0, 0.1, 0)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        self.steps.append((levels[0], sensed[0], elapsed_s))
        if len(self.steps) - 1 != self._last:
            return Estimate(30.0, 5.0, 0.1, 0)
        if isinstance(self._end, BaseException):
            raise self._end
        return Estimate(self._end, 5.0, 0.1, 0)


def parts_of(
    driver: ScriptedDriver,
    estimator: Estimator | None = None,
    controller: Controller | None = None,
    clock: Clock | None = None,
    stop_requested: Callable[[], bool] = lambda: False,
    settle: int = SETTLE,
    samples: int = 10,
    reading_delay: int = 0,
) -> tuple[LoopParts, LoopPlan, Recorder]:
    """Parts and plan of a run that plays `samples` currents 5.0, 5.1 ... mA after settling at 1 mA."""
    estimator, controller = estimator or WrittenEstimator(), controller or PlaybackController()
    signals = Recorder(signal_columns(driver.profile, estimator, controller))
    parts = LoopParts(
        driver=driver,
        estimator=estimator,
        controller=controller,
        limits=(CommandLimits(low=SAFE, high=9.0, safe=SAFE),),
        plausibility=Plausibility(sensed_low=(100.0,), sensed_high=(10e6,), names=("resistance [ohm]",)),
        clock=clock or SimulatedClock(),
        signals=signals,
        timings=Recorder(TIMING_COLUMNS),
        stop_requested=stop_requested,
    )
    setpoints = np.array([levels_mA(k) for k in range(samples)])
    plan = LoopPlan(period_s=1e-3, setpoints=setpoints, settle_steps=settle, reading_delay=reading_delay)
    return parts, plan, signals


def levels_mA(sample: int) -> float:
    """The current that is played in a sample."""
    return 5.0 + sample / 10
