"""Open-loop excitations of the first command, in its unit, as one value per sample.

`damped_oscillation` is the paper's figure 4(a); `reversal_curves` visits the minor loops that a damped
oscillation leaves out (first-order reversal curves); both are staircases whose holds end in steady state.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_validator

from rtctl.border.arrays import FloatArray
from rtctl.border.units.quantities import Checked, Quantity
from rtctl.signals.levels import Level, LevelOf, hold, samples_in, whole_microseconds

Use = Literal["identify", "fit", "test"]


class _Excitation(Checked):
    hold_s: Annotated[float, Quantity("s"), Field(alias="hold", gt=0.0, allow_inf_nan=False)]
    use: Use = "fit"
    period_s: Annotated[Annotated[float, Quantity("s")] | None, Field(alias="period", gt=0.0)] = None
    """Sample period of this record [s]; None: the scenario's."""

    @field_validator("period_s")
    @classmethod
    def _whole_steps(cls, period_s: float | None) -> float | None:
        if period_s is not None:
            whole_microseconds(period_s)
        return period_s

    def held(self, values: FloatArray, period_s: float) -> FloatArray:
        return hold(values, samples_in(self.hold_s, period_s, "excitation.hold"))


class DampedOscillation(_Excitation):
    """Triangular sweeps between low and high whose reversal points close in on the middle in `cycles` cycles."""

    kind: Literal["damped_oscillation"] = "damped_oscillation"
    cycles: Annotated[int, Field(ge=1)] = 8
    step: Annotated[Level, LevelOf("command")] = Level(1.0, True)
    centre: Annotated[Level, LevelOf("command")] = Level(66.0, True)

    def build(self, low: float, high: float, period_s: float) -> FloatArray:
        """Return the level of each sample (n,), starting at `low`."""
        centre = self.centre.resolve(low, high)
        shrink = np.linspace(1.0, 0.0, self.cycles, endpoint=False)
        turns = [low]
        for factor in shrink:
            turns += [centre + factor * (high - centre), centre - factor * (centre - low)]
        return self.held(sweep(turns, self.step.resolve_width(low, high)), period_s)


class ReversalCurves(_Excitation):
    """First-order reversal curves of both branches: up to a point and back, then down from the top and back."""

    kind: Literal["reversal_curves"] = "reversal_curves"
    curves: Annotated[int, Field(ge=2)] = 12
    span: tuple[Annotated[Level, LevelOf("command")], Annotated[Level, LevelOf("command")]] = (
        Level(35.0, True),
        Level(95.0, True),
    )
    step: Annotated[Level, LevelOf("command")] = Level(1.5, True)

    def build(self, low: float, high: float, period_s: float) -> FloatArray:
        """Return the level of each sample (n,), starting at `low`."""
        first, last = (level.resolve(low, high) for level in self.span)
        turns = [low]
        for point in np.linspace(first, last, self.curves):
            turns += [float(point), low]
        turns.append(high)
        for point in np.linspace(last, first, self.curves):
            turns += [float(point), high]
        return self.held(sweep(turns, self.step.resolve_width(low, high)), period_s)


class RandomStaircase(_Excitation):
    """A staircase of independent uniform levels, as in the paper's figure 12(a)."""

    kind: Literal["random_staircase"] = "random_staircase"
    levels: Annotated[int, Field(ge=1)]
    seed: Annotated[int, Field(ge=0)]
    low: Annotated[Level, LevelOf("command")] = Level(0.0, True)
    high: Annotated[Level, LevelOf("command")] = Level(100.0, True)

    def build(self, low: float, high: float, period_s: float) -> FloatArray:
        """Return the level of each sample (n,)."""
        draw = np.random.default_rng(self.seed).uniform
        values = draw(self.low.resolve(low, high), self.high.resolve(low, high), self.levels)
        return self.held(values, period_s)


class LevelSequence(_Excitation):
    """A sequence of given levels, repeated `times` times."""

    kind: Literal["levels"] = "levels"
    levels: Annotated[tuple[Annotated[Level, LevelOf("command")], ...], Field(min_length=1)]
    times: Annotated[int, Field(ge=1)] = 1

    def build(self, low: float, high: float, period_s: float) -> FloatArray:
        """Return the level of each sample (n,)."""
        values = [level.resolve(low, high) for level in self.levels]
        return self.held(np.tile(np.asarray(values), self.times), period_s)


class CurrentSine(_Excitation):
    """A sine of one frequency about an offset (figure 6: loops at several frequencies)."""

    kind: Literal["sine"] = "sine"
    hold_s: Annotated[float, Quantity("s"), Field(alias="duration", gt=0.0, allow_inf_nan=False)]
    frequency_hz: Annotated[float, Quantity("Hz"), Field(alias="frequency", gt=0.0, allow_inf_nan=False)]
    offset: Annotated[Level, LevelOf("command")] = Level(50.0, True)
    amplitude: Annotated[Level, LevelOf("command")] = Level(50.0, True)

    def build(self, low: float, high: float, period_s: float) -> FloatArray:
        """Return the level of each sample (n,), starting at the minimum."""
        time_s = period_s * np.arange(samples_in(self.hold_s, period_s, "excitation.duration"))
        swing = -np.cos(2.0 * np.pi * self.frequency_hz * time_s)
        value: FloatArray = self.offset.resolve(low, high) + self.amplitude.resolve_width(low, high) * swing
        return value


class _Vibration(_Excitation):
    """A vibration around an offset over a band of frequencies, then a rest at the offset for `ring_down`."""

    hold_s: Annotated[float, Quantity("s"), Field(alias="duration", gt=0.0, allow_inf_nan=False)]
    frequency_low_hz: Annotated[float, Quantity("Hz"), Field(alias="frequency_low", gt=0.0)]
    frequency_high_hz: Annotated[float, Quantity("Hz"), Field(alias="frequency_high", gt=0.0)]
    offset: Annotated[Level, LevelOf("command")] = Level(50.0, True)
    amplitude: Annotated[Level, LevelOf("command")] = Level(50.0, True)
    """Largest excursion from the offset."""
    ring_down_s: Annotated[float, Quantity("s"), Field(alias="ring_down", ge=0.0)] = 0.0

    def times(self, period_s: float) -> FloatArray:
        """Return the times (n,) [s] before the ring-down. Raises ValueError if the samples cannot carry the band."""
        if not self.frequency_low_hz < self.frequency_high_hz < 0.5 / period_s:
            raise ValueError(
                f"frequency_low = {self.frequency_low_hz:g} Hz must be below frequency_high = "
                f"{self.frequency_high_hz:g} Hz, and that below half the sample rate, {0.5 / period_s:g} Hz"
            )
        count = samples_in(self.hold_s, period_s, "excitation.duration")
        return period_s * np.arange(count, dtype=np.float64)

    def around(self, swing: FloatArray, low: float, high: float, period_s: float) -> FloatArray:
        """Return `swing` (n,), within +-1, as levels around the offset, and the ring-down."""
        offset, amplitude = self.offset.resolve(low, high), self.amplitude.resolve_width(low, high)
        rest = np.full(round(self.ring_down_s / period_s), offset)
        return np.concatenate((offset + amplitude * swing, rest))


class FrequencySweep(_Vibration):
    """A sine whose frequency goes from `frequency_low` to `frequency_high` at a constant rate."""

    kind: Literal["frequency_sweep"] = "frequency_sweep"

    def build(self, low: float, high: float, period_s: float) -> FloatArray:
        """Return the level of each sample (n,)."""
        time_s = self.times(period_s)
        rise = (self.frequency_high_hz - self.frequency_low_hz) / self.hold_s
        swing: FloatArray = np.sin(2.0 * np.pi * (self.frequency_low_hz + 0.5 * rise * time_s) * time_s)
        return self.around(swing, low, high, period_s)


class RandomMultisine(_Vibration):
    """A multisine: every line of the band with the same amplitude and a random phase; one period lasts `duration`."""

    kind: Literal["random_multisine"] = "random_multisine"
    seed: Annotated[int, Field(ge=0)]

    def build(self, low: float, high: float, period_s: float) -> FloatArray:
        """Return the level of each sample (n,). Raises ValueError if no line of the period falls into the band."""
        count = len(self.times(period_s))
        frequency = np.fft.rfftfreq(count, period_s)
        inside = (frequency >= self.frequency_low_hz) & (frequency <= self.frequency_high_hz)
        if not inside.any():
            raise ValueError(f"no line of a period of {self.hold_s:g} s lies in the band; lengthen duration")
        phase = np.random.default_rng(self.seed).uniform(0.0, 2.0 * np.pi, len(frequency))
        swing: FloatArray = np.fft.irfft(np.where(inside, np.exp(1j * phase), 0.0), count)
        return self.around(swing / np.abs(swing).max(), low, high, period_s)


Excitation = Annotated[
    DampedOscillation
    | ReversalCurves
    | RandomStaircase
    | LevelSequence
    | CurrentSine
    | FrequencySweep
    | RandomMultisine,
    Field(discriminator="kind"),
]


def sweep(turning_points: list[float], step: float) -> FloatArray:
    """Return a staircase through the turning points in equal steps of at most `step`, which meets each exactly."""
    if not step > 0.0:
        raise ValueError(f"excitation.step must be > 0, got {step!r}")
    parts = [np.asarray(turning_points[:1])]
    for start, end in zip(turning_points, turning_points[1:], strict=False):
        count = max(1, int(np.ceil(abs(end - start) / step - 1e-9)))
        parts.append(np.linspace(start, end, count + 1)[1:])
    return np.concatenate(parts)
