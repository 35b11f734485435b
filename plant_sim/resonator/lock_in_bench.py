"""A resonator's bench for any oscillator: its model file's beam behind a coil driver and a lock-in.

The same device measured two ways: sample by sample as an "oscillator" (`plant`), whose records a diagnosis reads, or
through a lock-in as an "me" device, whose loop holds amplitude and phase. The coil's current is the model's drive,

    u(t) = A cos theta(t - delay),   theta' = 2 pi f      phase and past are kept when A or f changes

and the lock-in fits, by least squares over the last sample period or two cycles, whichever is longer,

    reading = c_0 + Re sum_n Z_n exp(i n theta),   n = 1 ... 3        Z_1 = X + iY

so harmonics up to the third and an offset leave X and Y alone. The vibrometer's amplitude is |Z_1| of the true motion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from plant_sim.oscillator.device_table import read_device_table
from plant_sim.oscillator.mechanism import Driven
from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.motion import Equation
from plant_sim.oscillator.plant import acting
from plant_sim.oscillator.simulation import OscillatorSimulation
from plant_sim.oscillator.streaming import DELAYS
from plant_sim.oscillator.streaming import Path as SignalPath
from plant_sim.resonator.device_file import CoilDriver, LockIn
from plant_sim.resonator.plant import converted
from plant_sim.sensing import NoiseSource
from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.border.model_file import read_model_file
from rtctl.border.records import ME
from rtctl.border.units.quantities import Checked, check, read_toml

LEAST_STEPS = 64
"""Steps in a cycle."""
CYCLES = 2.0
"""Least cycles that a reading takes in."""
HARMONICS = 3
UNITS = {"drive": "mA", "displacement": "um"}


class Nameplate(Checked):
    """The `[plant]` table."""

    kind: Literal["me"]
    name: Annotated[str, Field(pattern=r"^[\x20-\x7e]{1,16}$")]
    seed: Annotated[int, Field(ge=0)] = 0
    model: str
    """Model file of the beam, beside this one; drive in mA, displacement in um."""


class BenchFile(Checked):
    """The whole file."""

    plant: Nameplate
    coil: CoilDriver
    lock_in: LockIn


class Wave:
    """The commanded current and its history, from which a delayed drive is computed."""

    def __init__(self, frequency_hz: float) -> None:
        self._held: list[tuple[float, float, float, float]] = [(-math.inf, 0.0, frequency_hz, 0.0)]
        self.phase = 0.0

    def hold(
        self, start_s: float, current_mA: float, frequency_hz: float, dt_s: float, keep_s: float
    ) -> None:
        """Hold a command from `start_s` on; nothing older than `keep_s` before it will be asked for."""
        self._held.append((start_s, current_mA, frequency_hz, self.phase))
        self.phase = math.fmod(self.phase + 2.0 * math.pi * frequency_hz * dt_s, 2.0 * math.pi)
        while len(self._held) > 1 and self._held[1][0] <= start_s - keep_s:
            self._held.pop(0)

    def at(self, time_s: FloatArray) -> FloatArray:
        """Return u [mA]."""
        starts, currents, frequencies, phases = np.array(self._held).T
        which = np.searchsorted(starts, time_s, side="right") - 1
        since = np.where(np.isfinite(starts[which]), time_s - starts[which], 0.0)
        current: FloatArray = currents[which] * np.cos(
            2.0 * math.pi * frequencies[which] * since + phases[which]
        )
        return current


class LockInBench:
    """A simulated device (see `plant_sim.plant.Plant`)."""

    profile = ME

    def __init__(
        self, bench: BenchFile, simulation: OscillatorSimulation, broken_above: float, seed: int | None = None
    ) -> None:
        """Build the bench; `seed` replaces that of the file's noise."""
        coil = bench.coil
        self.identity = bench.plant.name
        self.low: tuple[float, ...] = (0.0, coil.frequency_low)
        self.high: tuple[float, ...] = (coil.current_high, coil.frequency_high)
        self.safe: tuple[float, ...] = (0.0, coil.frequency_rest)
        self._lock_in, self._broken_above = bench.lock_in, broken_above
        self._seed = bench.plant.seed if seed is None else seed
        active = acting(simulation)
        self._delay_s = sum(DELAYS[one.id](values) for one, values in active if one.id in DELAYS)
        self._acting = [(one, values) for one, values in active if one.id not in DELAYS]
        values = np.array([[parameter.value for parameter in simulation.parameters]])
        self._equation = Equation.of(simulation.parameters, [one for one, _ in active], values)
        rate = self._equation.rates(bench.lock_in.converter_range, coil.current_high)[0] / (2.0 * math.pi)
        self._steps_per_s = LEAST_STEPS * max(rate, coil.frequency_high)
        self.reset()

    def reset(self) -> None:
        """Reset to power-up: at rest, noise from the start."""
        self._z, self._v = np.zeros(1), np.zeros(1)
        self._own = np.zeros((self._equation.states, 1))
        self._path = SignalPath(self._acting)
        self._wave = Wave(self.safe[1])
        self._noise = NoiseSource(self._seed)
        self._time_s = 0.0
        self._seen: FloatArray = np.zeros((0, 4))  # time, phase, true motion, reading
        self.diverged = False

    def advance(self, levels: Sequence[float], dt_s: float) -> None:
        """Hold `levels` ([mA], [Hz]) for `dt_s` [s]. Raises ValueError on what cannot be held."""
        current_mA, frequency_hz = levels
        if not (math.isfinite(current_mA) and 0.0 < frequency_hz < math.inf and dt_s >= 0.0):
            raise ValueError(f"{current_mA!r} mA at {frequency_hz!r} Hz for {dt_s!r} s cannot be held")
        if dt_s == 0.0 or self.diverged:
            return
        phase = self._wave.phase
        self._wave.hold(self._time_s, current_mA, frequency_hz, dt_s, self._delay_s)
        steps = max(1, math.ceil(dt_s * self._steps_per_s))
        h = dt_s / steps
        start: FloatArray = self._time_s + h * np.arange(steps, dtype=np.float64)
        times = np.column_stack((start, start + 0.5 * h, start + h - 1e-9 * h)) - self._delay_s
        nodes = self._path.to_equation(self._wave.at(times.reshape(-1)).reshape(times.shape), self._time_s, h)
        out_z, out_v = np.empty((steps + 1, 1)), np.empty((steps + 1, 1))
        self._equation.march(self._z, self._v, Driven(nodes, h), 1, (out_z, out_v), self._own)
        spot, sensed = self._path.trace(out_z[:, 0], nodes, h)
        self._time_s += dt_s
        self.diverged = not np.abs(out_z).max() <= self._broken_above
        ends = h * np.arange(1, steps + 1)
        angle = phase + 2.0 * math.pi * frequency_hz * ends
        rows = np.column_stack((start + h, angle, spot[1:], self._path.to_readings(sensed[1:], start + h)))
        since = self._time_s - max(dt_s, CYCLES / frequency_hz)
        kept = self._seen[self._seen[:, 0] > since + 1e-12]
        self._seen = np.concatenate((kept, rows[rows[:, 0] > since + 1e-12]))

    def measure(self) -> tuple[tuple[float, ...], float]:
        """Return ((in-phase, quadrature), reference amplitude) [um]; NaN once the beam has diverged."""
        if self.diverged:
            return (math.nan, math.nan), math.nan
        normals = self._noise.block[self._noise.next_row()]
        if len(self._seen) <= 2 * HARMONICS + 1:
            return (0.0, 0.0), 0.0
        angle = self._seen[:, 1]
        waves = [part(n * angle) for n in range(1, HARMONICS + 1) for part in (np.cos, np.sin)]
        coefficients = np.linalg.lstsq(
            np.column_stack([np.ones_like(angle), *waves]), self._seen[:, 2:], rcond=None
        )[0]
        duration_s = float(self._seen[-1, 0] - self._seen[0, 0])
        white, vibrometer = (
            density / math.sqrt(duration_s) for density in (self._lock_in.white, self._lock_in.vibrometer)
        )
        in_phase = converted(self._lock_in, float(coefficients[1, 1]) + white * float(normals[0]))
        quadrature = converted(self._lock_in, -float(coefficients[2, 1]) + white * float(normals[1]))
        amplitude = math.hypot(*coefficients[1:3, 0]) + vibrometer * float(normals[2])
        return (in_phase, quadrature), amplitude

    def step(self, levels: Sequence[float], dt_s: float) -> tuple[tuple[float, ...], float]:
        """Call `advance`, then `measure`."""
        self.advance(levels, dt_s)
        return self.measure()


def load_bench(path: Path, seed: int | None = None) -> LockInBench:
    """Return the bench of a device file that names a beam's model. Raises InputError with file and key."""
    bench = check(BenchFile, read_toml(path), str(path))
    beam = path.parent / bench.plant.model
    if not beam.is_file():
        raise InputError(f'{path}: plant.model = "{bench.plant.model}": no such file beside it')
    model = read_model_file(beam, "oscillator")
    table = read_device_table(model, beam)
    if (table.drive.unit, table.displacement.unit) != (UNITS["drive"], UNITS["displacement"]):
        raise InputError(
            f"{beam}: drive in {table.drive.unit}, displacement in {table.displacement.unit}; a lock-in's bench has "
            "them in mA and um"
        )
    return LockInBench(
        bench, oscillator_simulation(model, UNITS, str(beam)), table.displacement.broken_above, seed
    )
