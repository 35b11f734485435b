"""Protocols inside rtctl: what the loop asks of an estimator, a controller and a clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntFlag
from typing import Any, NamedTuple, Protocol

from rtctl.border.records import DeviceProfile
from rtctl.timing.clock import Tick

Column = tuple[str, str]
"""Name and unit of a recorded quantity."""


class EstimateStatus(IntFlag):
    """Why an estimate deserves less trust; 0 is a plain good estimate."""

    OK = 0
    SATURATED = 1  # the reading is at or beyond what the model can produce: clamped
    IN_GAP = 2  # between the heating and the cooling envelope: any temperature there gives this reading
    OUT_OF_RANGE = 4  # the surrogate lies outside the identified current range
    NOT_FINITE = 8  # the reading was NaN or infinite: held
    DISAGREES = 16  # two sources of the same quantity differ by more than their errors explain


class Estimate(NamedTuple):
    """An estimator's answer for one sample."""

    value: float
    """Estimated output, in the unit of the profile's reference."""
    surrogate: float
    """What stands between reading and output, as the estimator's `surrogate` names it; NaN where unused."""
    confidence: float
    """Standard error (one sigma) of `value` as the estimator believes it, same unit; no probability. The name stays:
    parts of others read it."""
    status: int
    """`EstimateStatus` bits."""

    @property
    def settled(self) -> float:
        """What a controller answers: `value`, without a swing that the loop cannot damp."""
        return self.value


class Estimator(Protocol):
    """Sensed values to the controlled output. Holds its own memory; `start` forgets it."""

    surrogate: Column
    """Name and unit of `Estimate.surrogate`."""

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Begin at rest (on the branch that it leaves, where there is hysteresis), at the applied levels."""
        ...

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """One sample: `levels` were applied for `elapsed_s`, `sensed` was measured at the end of that."""
        ...


class ControlAction(NamedTuple):
    """A controller's answer with its terms, so that a recording shows why."""

    levels: tuple[float, ...]
    """Command before the limits, one a channel of the device."""
    terms: tuple[float, ...]
    """In the order of the controller's `terms`."""


class Controller(Protocol):
    """Setpoint and estimate to command levels."""

    terms: tuple[Column, ...]
    """Names and units of `ControlAction.terms`."""
    preview_s: float
    """How far beyond the next sample lies the setpoint that `upcoming` is: 0, or the dead time of a known plant."""

    def start(self, levels: Sequence[float], setpoint: float, estimate: Estimate) -> None:
        """Bumpless: the first command continues from the applied `levels`."""
        ...

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        """Take one sample. `upcoming` is the setpoint one period and `preview_s` ahead, for feedforward."""
        ...

    def applied(self, levels: Sequence[float]) -> None:
        """Take note of what the limits passed of the last action (anti-windup)."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """What is known of a run when its parts are built; own estimators and controllers get it as `setup`."""

    profile: DeviceProfile
    """Commands, readings and reference of the device, with units."""
    period_s: float
    """Sample period [s]."""
    delay: int
    """Periods between a command and the first reading that knows of it, beyond one."""
    low: tuple[float, ...]
    """Lowest level of each command, in its unit."""
    high: tuple[float, ...]
    """Highest level of each command, in its unit."""
    output_low: float
    """Lowest output that a setpoint may ask for, in the unit of the reference."""
    output_high: float
    """Highest output that a setpoint may ask for, in the unit of the reference."""
    model: Any = None
    """The model of the run, of the type that its kind of plant reads; None: there is none."""


class Clock(Protocol):
    """Time as the loop sees it: injected, so that a lockstep run never looks at the machine's clock."""

    def start(self, period_s: float) -> None:
        """Set the period of the deadlines and count from here."""
        ...

    def wait(self) -> Tick:
        """Wait for the next deadline."""
        ...


class SignalRecorder(Protocol):
    """Takes one row a step and must not block."""

    def append(self, row: tuple[float, ...]) -> None:
        """One row, in the order of the recorder's columns."""
        ...
