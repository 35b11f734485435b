"""Amplitude and phase from the outputs of a device's lock-in, with the noise that they carry.

    a = sqrt(X^2 + Y^2),   phi = atan2(Y, X)       z = X cos psi - Y sin psi = a cos(psi + phi)

psi is the phase of the coil's current, so phase resonance is phi = -90 deg. The noise of one reading is learned while
the loop runs, from second differences of the amplitude: a ramp drops out of them, and so does a phase that turns
because the drive is off resonance. Var(a_k - 2 a_(k-1) + a_(k-2)) = 6 s^2; s^2 is averaged over the last `MEMORY`
samples. A fast transient counts as noise for a while: the controller then waits, which is the safe side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rtctl.arithmetic.elementary import DEGREES, atan2
from rtctl.interfaces import Estimate, EstimateStatus
from rtctl.models.describing import unsaturated_amplitude
from rtctl.models.resonator import ResonatorModel, straightened

MEMORY = 100
LEAST_KNOWN = 4
"""Second differences from which on they tell the noise better than the first reading, maybe of a ringing resonator."""
NOT_FINITE = int(EstimateStatus.NOT_FINITE)


@dataclass(slots=True)
class LockInMemory:
    """Memory of `lock_in_step`."""

    last: float = 0.0
    """The last amplitude [um]."""
    before: float = 0.0
    """The one before it [um]."""
    variance: float = 0.0
    """Of one reading [um^2]."""
    learnt: float = 0.0
    """The same, from second differences [um^2]."""
    samples: int = 0
    """Amplitudes so far; 0: the next reading is the first."""
    phase_deg: float = 0.0
    """The last phase [deg]."""


def lock_in_step(s: Any, x: float, y: float) -> tuple[float, float, float, int]:
    """Return amplitude [um], phase [deg], standard error [um] and status bits; advance `LockInMemory` in place.

    Args:
        s: the memory.
        x: displacement in phase with the force [um].
        y: in quadrature [um].
    """
    amplitude = math.sqrt(x * x + y * y)
    if not math.isfinite(amplitude):
        return s.last, s.phase_deg, math.sqrt(s.variance), NOT_FINITE
    if s.samples == 0:  # at rest: the first reading is one sample of the noise
        s.last, s.before = amplitude, amplitude
        s.variance = 0.5 * amplitude * amplitude
        s.samples = 1
        s.phase_deg = DEGREES * atan2(y, x)
        return amplitude, s.phase_deg, math.sqrt(s.variance), 0
    difference = amplitude - 2.0 * s.last + s.before
    s.samples = min(s.samples + 1, MEMORY + 2)
    known = s.samples - 2  # second differences so far
    if known > 0:
        s.learnt += (difference * difference / 6.0 - s.learnt) / min(known, MEMORY)
    if known >= LEAST_KNOWN:
        s.variance = s.learnt
    s.before = s.last
    s.last = amplitude
    s.phase_deg = DEGREES * atan2(y, x)
    return amplitude, s.phase_deg, math.sqrt(s.variance), 0


class LockInEstimator:
    """The estimator of a resonator's amplitude [um]; its surrogate is the phase behind the current [deg]."""

    surrogate = ("phase", "deg")

    def __init__(self, model: ResonatorModel | None = None) -> None:
        """Correct the phasors for drive and sensor of `model`; None: take them as they are read."""
        self.model = model if model is not None and model.used else None
        self._memory = LockInMemory()

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Start at rest: the first reading is one sample of the noise."""
        self._memory = LockInMemory()
        return self.step(levels, sensed, 0.0)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """Return the estimate of one sample."""
        return Estimate(*lock_in_step(self._memory, *self._motion(levels, sensed)))

    def _motion(self, levels: Sequence[float], sensed: Sequence[float]) -> tuple[float, float]:
        """Return the displacement's phasor against the force."""
        x, y = float(sensed[0]), float(sensed[1])
        if self.model is None or not (math.isfinite(x) and math.isfinite(y)):
            return x, y
        size = math.sqrt(x * x + y * y)
        if self.model.sensor_curvature > 0.0 and size > 0.0:
            factor = unsaturated_amplitude(size, self.model.sensor_curvature) / size
            x, y = factor * x, factor * y
        return straightened(x, y, levels[1], self.model)
