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

from rtctl.interfaces import Estimate, EstimateStatus
from rtctl.models.resonator import ResonatorModel

MEMORY = 100
LEAST_KNOWN = 4
"""Second differences from which on they tell the noise better than the first reading, maybe of a ringing resonator."""
NOT_FINITE = int(EstimateStatus.NOT_FINITE)


class LockInEstimator:
    """The estimator of a resonator's amplitude [um]; its surrogate is the phase behind the current [deg]."""

    surrogate = ("phase", "deg")

    def __init__(self, model: ResonatorModel | None = None) -> None:
        """Correct the phasors for drive and sensor of `model`; None: take them as they are read."""
        self._model = model if model is not None and model.used else None
        self._amplitudes = (0.0, 0.0)  # the last one, and the one before
        self._variance = self._learnt = 0.0
        self._samples = 0
        self._phase_deg = 0.0

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Start at rest: the first reading is one sample of the noise."""
        sensed = self._motion(levels, sensed)
        amplitude = math.hypot(*sensed)
        self._amplitudes = (amplitude, amplitude)
        self._variance = 0.5 * amplitude * amplitude if math.isfinite(amplitude) else 0.0
        self._samples, self._learnt = 1, 0.0
        self._phase_deg = math.degrees(math.atan2(sensed[1], sensed[0]))
        return self._estimate(amplitude)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """Return the estimate of one sample."""
        in_phase, quadrature = self._motion(levels, sensed)
        amplitude = math.sqrt(in_phase * in_phase + quadrature * quadrature)
        if not math.isfinite(amplitude):
            return self._estimate(self._amplitudes[0], NOT_FINITE)
        last, before = self._amplitudes
        difference = amplitude - 2.0 * last + before
        self._samples += 1
        known = self._samples - 2  # second differences so far
        if known > 0:
            self._learnt += (difference * difference / 6.0 - self._learnt) / min(known, MEMORY)
        if known >= LEAST_KNOWN:
            self._variance = self._learnt
        self._amplitudes = (amplitude, last)
        self._phase_deg = math.degrees(math.atan2(quadrature, in_phase))
        return self._estimate(amplitude)

    def _motion(self, levels: Sequence[float], sensed: Sequence[float]) -> Sequence[float]:
        """Return the displacement's phasor against the force."""
        if self._model is None or not all(map(math.isfinite, sensed)):
            return sensed
        phasor = self._model.motion(complex(*sensed), levels[1])
        return phasor.real, phasor.imag

    def _estimate(self, amplitude: float, status: int = 0) -> Estimate:
        return Estimate(amplitude, self._phase_deg, math.sqrt(self._variance), status)
