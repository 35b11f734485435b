"""A plant whose readings follow from what was done to it: exact in float32 for round numbers."""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.border.records import VO2


class RecordingPlant:
    """Reads 1000 + charge and -charge, charge = integral of the current [mA s]; keeps every hold."""

    profile = VO2
    identity = "RECORDER"
    low = (1.0,)
    high = (8.0,)
    safe = (0.5,)

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        self.charge = 0.0
        self.holds: list[tuple[float, float]] = []
        self.readings = 0

    def advance(self, levels: Sequence[float], dt_s: float) -> None:
        (level,) = levels
        self.holds.append((level, dt_s))
        self.charge += level * dt_s

    def measure(self) -> tuple[tuple[float, ...], float]:
        self.readings += 1
        return (1000.0 + self.charge,), -self.charge

    def step(self, levels: Sequence[float], dt_s: float) -> tuple[tuple[float, ...], float]:
        self.advance(levels, dt_s)
        return self.measure()

    @property
    def levels(self) -> list[float]:
        return [level for level, _ in self.holds]


class ManualClock:
    """Seconds that pass when the test says so."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def forbidden_clock() -> float:
    raise AssertionError("a lockstep device must not look at the machine's clock")
