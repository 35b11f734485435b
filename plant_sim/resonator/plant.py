"""The magnetoelectric resonator: coil current and frequency -> a Duffing beam -> lock-in outputs and a vibrometer.

Sign convention, with psi the phase of the coil's measured current: `z = X cos psi - Y sin psi`, so X + iY is the
displacement's phasor and at phase resonance (90 degrees behind the current) X = 0 and Y < 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from plant_sim.kernels import direct
from plant_sim.resonator.device_file import LockIn, MeDeviceFile
from plant_sim.resonator.inspection import MeInspection
from plant_sim.resonator.kernel import PARAMETERS, STATE, Array, demodulated, half_grid, hold
from plant_sim.sensing import NoiseSource
from rtctl.border.records import ME

MU_0 = 4e-7 * math.pi
LEAST_CURRENT_A = 1e-4
"""Current below which the lock-in keeps the phase that it measured last: no current has none."""
DECAYED = 40.0
"""Time constants of the beam after which a held drive is in steady state; no hold is simulated for longer."""


def kernel_parameters(device: MeDeviceFile) -> Array:
    """Return the kernel's parameters of a file."""
    coil, film, beam = device.coil, device.magnetisation, device.beam
    omega = 2.0 * math.pi * beam.frequency
    values = (
        coil.resistance / coil.inductance,
        3.0 * film.susceptibility * coil.field / MU_0 / film.saturation,
        beam.drive * film.saturation,
        omega / beam.quality,
        omega**2,
        beam.stiffness_cubic,
        beam.stiffness_quintic,
        beam.broken_above,
    )
    return np.array([values], dtype=PARAMETERS)


class MeResonator:
    """A simulated device (see `plant_sim.plant.Plant`)."""

    profile = ME

    def __init__(self, device: MeDeviceFile, seed: int | None = None) -> None:
        """Build the device; `seed` replaces that of the file's noise."""
        coil = device.coil
        self.identity = device.plant.name
        self.low: tuple[float, ...] = (0.0, coil.frequency_low)
        self.high: tuple[float, ...] = (coil.current_high, coil.frequency_high)
        self.safe: tuple[float, ...] = (0.0, coil.frequency_rest)
        self._lock_in = device.lock_in
        self._seed = device.plant.seed if seed is None else seed
        self._parameters = kernel_parameters(device)
        self._decayed_s = DECAYED * 2.0 * device.beam.quality / (2.0 * math.pi * device.beam.frequency)
        self._waves = half_grid()
        self.reset()

    def inspection(self) -> MeInspection:
        """Return a look into the device."""
        return MeInspection(lambda: (self.displacement_um, self.coil_current_mA))

    def reset(self) -> None:
        """Reset to power-up: at rest, noise from the start."""
        self._state = np.zeros(1, dtype=STATE)
        self._phasors = np.zeros(4)  # Z [um] and I [A], real and imaginary parts
        self._lag = complex(1.0, 0.0)  # of the current behind the command
        self._noise = NoiseSource(self._seed)
        self._reading: tuple[tuple[float, ...], float] = ((0.0, 0.0), 0.0)
        self._hold = direct(hold, self._parameters, self._state, self._waves, 0.0, 1.0, 0.0)
        self._demodulated = direct(demodulated, self._state, self._phasors)

    def advance(self, levels: Sequence[float], dt_s: float) -> None:
        """Hold `levels` ([mA], [Hz]) for `dt_s` [s]. Raises ValueError on what cannot be held."""
        current_mA, frequency_hz = levels
        if not (math.isfinite(current_mA) and 0.0 < frequency_hz < math.inf and dt_s >= 0.0):
            raise ValueError(f"{current_mA!r} mA at {frequency_hz!r} Hz for {dt_s!r} s cannot be held")
        simulated_s = min(dt_s, self._decayed_s)  # from then on it repeats itself, relative to its drive
        self._hold(self._parameters, self._state, self._waves, 1e-3 * current_mA, frequency_hz, simulated_s)

    def measure(self) -> tuple[tuple[float, ...], float]:
        """Return ((in-phase, quadrature), reference amplitude) [um]; NaN once the beam has diverged.

        The same as before if no cycle of the drive has ended since.
        """
        if self.diverged:
            return (math.nan, math.nan), math.nan
        duration_s = self._demodulated(self._state, self._phasors)
        if duration_s > 0.0:
            self._reading = self._read(duration_s)
        return self._reading

    def step(self, levels: Sequence[float], dt_s: float) -> tuple[tuple[float, ...], float]:
        """Call `advance`, then `measure`."""
        self.advance(levels, dt_s)
        return self.measure()

    @property
    def diverged(self) -> bool:
        """The beam has left the range of the model: only a power cycle (`reset`) brings it back."""
        return bool(self._state["diverged"][0])

    @property
    def displacement_um(self) -> float:
        """The true displacement now."""
        return float(self._state["displacement"][0])

    @property
    def coil_current_mA(self) -> float:
        """The true coil current now."""
        return 1e3 * float(self._state["current"][0])

    def _read(self, duration_s: float) -> tuple[tuple[float, ...], float]:
        """Return the readings of the phasors; the noise of a mean over `duration_s` falls with its root."""
        displacement = complex(self._phasors[0], self._phasors[1])
        current = complex(self._phasors[2], self._phasors[3])
        if self._lock_in.reference == "current" and abs(current) > LEAST_CURRENT_A:
            self._lag = current / abs(current)
        normals = self._noise.block[self._noise.next_row()]
        white, vibrometer = (
            density / math.sqrt(duration_s) for density in (self._lock_in.white, self._lock_in.vibrometer)
        )
        phasor = displacement * self._lag.conjugate()
        in_phase = converted(self._lock_in, phasor.real + white * float(normals[0]))
        quadrature = converted(self._lock_in, phasor.imag + white * float(normals[1]))
        return (in_phase, quadrature), abs(displacement) + vibrometer * float(normals[2])


def converted(lock_in: LockIn, value_um: float) -> float:
    """Return one output [um] behind the converter."""
    if lock_in.converter_bits == 0:
        return value_um
    half = 2.0 ** (lock_in.converter_bits - 1)
    step = lock_in.converter_range / half
    return step * min(max(round(value_um / step), -half), half - 1.0)
