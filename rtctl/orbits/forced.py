"""What a motion under harmonic drive consists of: a model's lanes, their states, their marching."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.simulation import FreeParameter


class Motion(Protocol):
    """Rows (rows, lanes) of a march, the first its start."""

    @property
    def displacement(self) -> FloatArray:
        """(rows, lanes)"""
        ...

    @property
    def velocity(self) -> FloatArray:
        """(rows, lanes)"""
        ...


class Forced(Protocol):
    """A model that is driven by A cos(2 pi f t)."""

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """Nominal ones, then the mechanisms'."""
        ...

    def march(
        self,
        values: FloatArray,
        frequency_hz: FloatArray,
        amplitude: FloatArray,
        state: FloatArray,
        periods: int,
        steps_per_period: int,
        rows_per_period: int = 1,
    ) -> Motion:
        """So many periods of each lane's drive from `state` (lanes, 2) at its crest."""
        ...

    def fastest_hz(self, values: FloatArray, reach: float, drive: float) -> float:
        """Of the models' poles for motions up to `reach` under drives up to `drive`."""
        ...


class Lanes(NamedTuple):
    """Oscillators side by side, each with parameters and a drive of its own."""

    values: FloatArray
    """(lanes, parameters)"""
    frequency_hz: FloatArray
    amplitude: FloatArray

    @property
    def number(self) -> int:
        """Of lanes."""
        return len(self.frequency_hz)

    def of(self, chosen: IntArray) -> Lanes:
        """These lanes alone."""
        return Lanes(self.values[chosen], self.frequency_hz[chosen], self.amplitude[chosen])


class Drive(NamedTuple):
    """A model, and how finely a period of its drive is integrated."""

    model: Forced
    steps_per_period: int

    def march(self, lanes: Lanes, state: FloatArray, periods: int, rows_per_period: int = 1) -> Motion:
        """So many periods of `lanes` from `state` (lanes, 2)."""
        return self.model.march(
            lanes.values, lanes.frequency_hz, lanes.amplitude, state, periods, self.steps_per_period, rows_per_period
        )  # fmt: skip
