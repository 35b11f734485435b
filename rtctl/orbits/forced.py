"""Motion under harmonic drive: a model's lanes, their states and their integration."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.simulation import FreeParameter


class Motion(Protocol):
    """Rows (rows, lanes) of an integration, the first its start."""

    @property
    def displacement(self) -> FloatArray:
        """Displacement (rows, lanes)."""
        ...

    @property
    def velocity(self) -> FloatArray:
        """Velocity (rows, lanes)."""
        ...


class Forced(Protocol):
    """A model driven by A cos(2 pi f t)."""

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """Parameters: the nominal ones, then the mechanisms'."""
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
        """Integrate `periods` drive periods of each lane from `state` (lanes, 2) at the drive's crest.

        Args:
            values: (lanes, parameters) parameter values.
            frequency_hz: (lanes,) drive frequencies [Hz].
            amplitude: (lanes,) drive amplitudes.
            state: (lanes, 2) displacement and velocity.
            periods: Number of drive periods.
            steps_per_period: Integrator steps per drive period.
            rows_per_period: Rows that are kept per drive period.
        """
        ...

    def fastest_hz(self, values: FloatArray, reach: float, drive: float) -> float:
        """Return the highest pole frequency [Hz] for motions up to `reach` under drives up to `drive`."""
        ...


class Lanes(NamedTuple):
    """Oscillators side by side, each with its own parameters and drive."""

    values: FloatArray
    """Parameter values (lanes, parameters)."""
    frequency_hz: FloatArray
    amplitude: FloatArray

    @property
    def number(self) -> int:
        """Number of lanes."""
        return len(self.frequency_hz)

    def of(self, chosen: IntArray) -> Lanes:
        """Return the chosen lanes."""
        return Lanes(self.values[chosen], self.frequency_hz[chosen], self.amplitude[chosen])


class Drive(NamedTuple):
    """A model, and how finely a period of its drive is integrated."""

    model: Forced
    steps_per_period: int

    def march(self, lanes: Lanes, state: FloatArray, periods: int, rows_per_period: int = 1) -> Motion:
        """Integrate `periods` drive periods of `lanes` from `state` (lanes, 2)."""
        return self.model.march(
            lanes.values, lanes.frequency_hz, lanes.amplitude, state, periods, self.steps_per_period, rows_per_period
        )  # fmt: skip
