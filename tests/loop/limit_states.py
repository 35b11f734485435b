"""The last line of defence in every state of a grid: what reaches the device, whatever is asked and whatever is read.

    python tests/loop/limit_states.py [--levels 21] [--squares 11] [--length 3]

`steps` takes one sample of the real loop from each state (level in force x mean square of the command x periods
missed), for each level that a controller may ask for and each reading that a device may give: what holds in every
state after one sample holds for ever, since the first state is one of them. `memories` does the same with the compiled
controller, for each of its memories and estimates. `sequences` plays every sequence of asked levels and readings
through the whole loop, which knows a reading that is stale or jumps only by those before it. Each counts, and raises
AssertionError.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from loop_cases import FIRST, WrittenEstimator, parts_of

from rtctl.border.errors import DriverError, Fault
from rtctl.border.records import VO2, DeviceStatus, Measurement
from rtctl.controllers.playback import PlaybackController
from rtctl.interfaces import ControlAction, Estimate
from rtctl.loop.compiled.step import HIGH, INTEGRAL, KI, KP, LOW, SLEW, pi_within_limits
from rtctl.loop.sampler import LoopParts, Position, Sampler
from rtctl.loop.step import ReadableStep
from rtctl.loop.supervisor import run_loop
from rtctl.safety.guards import EnergyGuard, ReadingGuard, ReadingRules
from rtctl.safety.limits import CommandLimits

PERIOD_S = 1e-3
LIMITS = CommandLimits(low=4.0, high=8.0, safe=1.0, slew_per_s=500.0, rms=7.0, rms_window_s=0.05)
REACH = LIMITS.slew_per_s * PERIOD_S
EXTREMES = (math.nan, math.inf, -math.inf, 1.7e308, -1.7e308, 5e-324, -0.0)
ENABLED = int(DeviceStatus.ENABLED)
ROUNDING = 1e-12
"""Relative: a limit and what is compared with it are rounded once."""


def healthy(before: Measurement) -> Measurement:
    """What a healthy device reads a period later."""
    return before._replace(
        sensed=(before.sensed[0] + 3.0,), counter=before.counter + 1, time_us=before.time_us + 1000
    )


def readings(before: Measurement) -> dict[str, Measurement]:
    """Each kind of reading that may follow on `before`; those whose names begin with "good" are a healthy device's."""
    good = healthy(before)
    found = {
        "good": good,
        "good, clamped": good._replace(status=ENABLED | int(DeviceStatus.CLAMPED)),
        "good, lowest": good._replace(sensed=(100.0,)),
        "good, without a reference": good._replace(reference=math.nan),
        "stale": before,
        "stale in part": good._replace(counter=before.counter),
        "gone back": good._replace(counter=before.counter - 5),
        "jumped": good._replace(counter=good.counter + 7),
        "clock stands": good._replace(time_us=before.time_us),
        "clock jumps": good._replace(time_us=good.time_us + 5000),
        "watchdog tripped": good._replace(status=ENABLED | int(DeviceStatus.WATCHDOG_TRIPPED)),
        "sensor fault": good._replace(status=ENABLED | int(DeviceStatus.SENSOR_FAULT)),
        "refused": good._replace(status=ENABLED | int(DeviceStatus.REFUSED)),
        "not enabled": good._replace(status=0),
    }
    values = {"NaN": math.nan, "inf": math.inf, "-inf": -math.inf, "zero": 0.0, "negative": -1e4, "huge": 1e300,
              "too low": math.nextafter(100.0, 0.0), "too high": math.nextafter(10e6, math.inf)}  # fmt: skip
    return found | {name: good._replace(sensed=(value,)) for name, value in values.items()}


class Asking:
    """A controller that asks for what it is told to, and an estimator that says anything."""

    terms = PlaybackController().terms
    preview_s = 0.0

    def __init__(self, asked: Iterator[float]) -> None:
        self._asked = asked

    def start(self, levels: Sequence[float], setpoint: float, estimate: Estimate) -> None:
        pass

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        return ControlAction((next(self._asked),), (0.0,) * len(self.terms))

    def applied(self, levels: Sequence[float]) -> None:
        pass


class Played:
    """A device that reads what it is told to, and notes its commands."""

    profile, identity = VO2, "ANY"

    def __init__(self, kinds: Sequence[str], settle: int) -> None:
        self._kinds, self._settle, self._before = kinds, settle, FIRST
        self.commands: list[float] = []
        self.closed_with: list[tuple[float, ...]] = []

    def open(self, *, lockstep_period_us: int | None, watchdog_ms: int, timeout_s: float) -> Measurement:
        return FIRST

    def exchange(self, levels: Sequence[float]) -> Measurement:
        at = len(self.commands) - self._settle
        self.commands.append(levels[0])
        self._before = readings(self._before)[self._kinds[at] if at >= 0 else "good"]
        return self._before

    def close(self, safe_levels: Sequence[float]) -> None:
        self.closed_with.append(tuple(safe_levels))


def guarded_parts(driver: Played, asking: Asking, samples: int) -> tuple[LoopParts, object]:
    """The real loop around both, with all of its guards."""
    parts, plan, _ = parts_of(driver, controller=asking, samples=samples)  # type: ignore[arg-type]
    rules = ReadingRules(
        names=("resistance [ohm]",), rates=(math.inf,), frozen_after=20, frozen_travel=1.0, lockstep_us=1000
    )
    energy = EnergyGuard((LIMITS,), ["current [mA]"])
    return replace(parts, limits=(LIMITS,), guard=ReadingGuard(rules), energy=energy), plan


def asked_levels(levels: int) -> list[float]:
    """A grid beyond both ends of the range, the ends and their neighbours, and what is hardly a number."""
    grid = np.linspace(LIMITS.low - 2.0, LIMITS.high + 2.0, levels).tolist()
    ends = [math.nextafter(end, to) for end in (LIMITS.low, LIMITS.high) for to in (-math.inf, math.inf)]
    return [*grid, LIMITS.low, LIMITS.high, *ends, *EXTREMES]


def mean_square(square: float, level: float, held_s: float) -> float:
    """Return the mean square [mA^2] after a level [mA] was held [s]: the definition, computed apart from the guard."""
    return level**2 + (square - level**2) * math.exp(-held_s / LIMITS.rms_window_s)


def check_level(level: float, before: float, elapsed_s: float) -> None:
    """Raise AssertionError for a level that must not be commanded after `before`."""
    assert LIMITS.low <= level <= LIMITS.high, f"{level!r} is out of range"
    reach = LIMITS.slew_per_s * elapsed_s * (1.0 + ROUNDING) + ROUNDING * LIMITS.high
    if LIMITS.low <= before <= LIMITS.high:
        assert abs(level - before) <= reach, f"{before!r} -> {level!r} is too fast"
    else:
        assert abs(level - before) <= max(reach, LIMITS.low - before, before - LIMITS.high)


def steps(levels: int = 9, squares: int = 5) -> int:
    """One sample from each state; return how many."""
    asked: list[float] = [LIMITS.safe]
    driver = Played(["good"], settle=1)
    parts, plan = guarded_parts(driver, Asking(iter(lambda: asked[0], None)), samples=2)
    step = ReadableStep(WrittenEstimator(), parts.controller, parts.limits)
    parts.energy.start((LIMITS.safe,))
    sampler = Sampler(parts, plan, step, FIRST, (LIMITS.safe,), Position())  # type: ignore[arg-type]
    assert parts.guard is not None
    first, memory = healthy(FIRST), parts.guard.memory
    most = LIMITS.rms * LIMITS.rms
    before_levels = [LIMITS.safe, *np.linspace(LIMITS.low, LIMITS.high, levels).tolist()]
    states = itertools.product(
        before_levels, [*np.linspace(0.0, most, squares).tolist(), math.nextafter(most, 0.0)], (0, 1, 40)
    )
    parts.guard.start()
    parts.guard.judge(first, FIRST, LIMITS.safe, PERIOD_S, 0, 0)
    clean, kinds, wanted, count = memory.copy(), readings(first), asked_levels(levels), 0
    for before, square, missed in states:
        for (kind, reading), level in itertools.product(kinds.items(), wanted):
            memory[:], asked[0] = clean, level
            sampler.levels, sampler.reading, sampler.at.index = (before,), first, -1
            parts.energy.mean_squares[0] = square
            fault = None
            try:
                if missed:
                    sampler.missed(missed)
                sampler.complete(0, missed, 0.0, reading, 0, 0)
            except DriverError as error:
                fault = error.fault
            count += 1
            where = f"{before!r} mA, {square!r} mA^2, {missed} missed, read {kind}, asked {level!r}"
            if fault is None:
                assert kind.startswith("good"), f"believed: {where}"
                assert math.isfinite(level), where
                check_level(sampler.levels[0], before, (missed + 1) * PERIOD_S)
                held = mean_square(square, before, missed * PERIOD_S) if missed else square
                after = mean_square(held, sampler.levels[0], PERIOD_S)
                assert after <= most * (1.0 + ROUNDING), f"too much energy: {where}"
            elif kind.startswith("good") and math.isfinite(level):
                assert fault is Fault.ENERGY_LIMIT, f"{fault}: {where}"
    return count


def memories(levels: int = 9) -> int:
    """The compiled controller with each memory, estimate and feedforward; return how many."""
    numbers = [*EXTREMES, -40.0, 0.0, 4.0, 6.0, 55.0]
    before_levels = [LIMITS.safe, *np.linspace(LIMITS.low, LIMITS.high, levels).tolist()]
    control, count = np.zeros(8), 0
    for integral, forward, value, setpoint, before in itertools.product(
        numbers, numbers, numbers, (*EXTREMES, 30.0), before_levels
    ):
        control[[INTEGRAL, KP, KI, LOW, HIGH, SLEW]] = (
            integral, 0.02, 8.0, LIMITS.low, LIMITS.high, LIMITS.slew_per_s,
        )  # fmt: skip
        allowed, asked, *_ = pi_within_limits(control, forward, value, setpoint, before, PERIOD_S)
        if math.isfinite(asked):
            check_level(allowed, before, PERIOD_S)
        count += 1
    return count


SEQUENCE_ASKS = (math.nan, math.inf, -1.7e308, 3.0, 5.0, 9.0)


def sequences(length: int = 2) -> int:
    """Every sequence through the whole loop, until it has ended; return how many."""
    symbols = list(itertools.product(readings(FIRST), SEQUENCE_ASKS))
    count, open_ends = 0, [()]
    for _ in range(length):
        longer = []
        for begin, symbol in itertools.product(open_ends, symbols):
            count += 1
            if _survives(tried := (*begin, symbol)):
                longer.append(tried)
        open_ends = longer
    return count


def _survives(symbols: Sequence[tuple[str, float]]) -> bool:
    """Play one sequence and check it; return whether the loop was still under way at its end."""
    settle = 3
    driver = Played([kind for kind, _ in symbols], settle)
    asking = Asking(iter([5.0, *(asked for _, asked in symbols)]))
    parts, plan = guarded_parts(driver, asking, len(symbols))
    outcome = run_loop(parts, plan, FIRST)  # type: ignore[arg-type]
    assert driver.closed_with == [(LIMITS.safe,)], symbols
    assert driver.commands[:settle] == settle * [LIMITS.safe]
    before, square = LIMITS.safe, LIMITS.safe**2
    for k, level in enumerate(driver.commands[settle:]):
        check_level(level, before, PERIOD_S)
        square = mean_square(square, level, PERIOD_S)
        assert square <= LIMITS.rms**2 * (1.0 + 1e-9)
        assert all(kind.startswith("good") for kind, _ in symbols[:k]), f"commanded after a lie: {symbols}"
        before = level
    *_, (kind, asked) = symbols
    lies = not kind.startswith("good") or not math.isfinite(asked)
    assert (outcome.fault is not None) or not lies, symbols
    return outcome.fault is None


def main() -> int:
    """Explore and print the counts."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--levels", type=int, default=21)
    parser.add_argument("--squares", type=int, default=11)
    parser.add_argument("--length", type=int, default=3)
    arguments = parser.parse_args()
    print(f"{steps(arguments.levels, arguments.squares)} samples from every state", flush=True)
    print(f"{memories(arguments.levels)} memories of the compiled controller", flush=True)
    print(f"{sequences(arguments.length)} sequences of up to {arguments.length} samples", flush=True)
    print("no level out of range, too fast or too much energy, no lie believed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
