"""An oscillator as a device: a model file's equation and mechanisms, driven by one held command after the other.

The same equation and mechanisms as in a simulation of a record; `plant_sim.oscillator.streaming` has what lies before
and behind the equation. The step is that of the fastest pole at the sensor's range, so the integrator is not the
error; a device that nobody has looked at for long has forgotten what was longest ago, and is moved through the last
`LONGEST_HOLD_S` alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from plant_sim.oscillator.device_table import DeviceTable, read_device_table
from plant_sim.oscillator.equation.terms import CUBIC, DRIFT, QUADRATIC, QUINTIC, STIFFNESS
from plant_sim.oscillator.inspection import OscillatorInspection
from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values
from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.motion import Equation
from plant_sim.oscillator.simulation import OscillatorSimulation
from plant_sim.oscillator.streaming import Path as SignalPath
from plant_sim.oscillator.streaming import cannot_stream
from plant_sim.sensing import NoiseSource
from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError, NoStreamError
from rtctl.border.model_file import read_model_file
from rtctl.border.records import oscillator_profile

LONGEST_HOLD_S = 600.0
BLOCK_STEPS = 4096
FAST = 2e3
"""Angular frequency [1/s] above which a beam is observed in milliseconds."""
READING, REFERENCE = 0, 1
"""Columns of the noise source."""


class OscillatorPlant:
    """A simulated device (see `plant_sim.plant.Plant`)."""

    def __init__(
        self, simulation: OscillatorSimulation, device: DeviceTable, seed: int | None = None
    ) -> None:
        """Build the device; `seed` replaces that of its noise.

        Raises ValueError if no sensible step resolves the model.
        """
        self.profile = oscillator_profile(
            drive_unit=device.drive.unit, displacement_unit=device.displacement.unit
        )
        self.identity = device.name
        self.low: tuple[float, ...] = (device.drive.low,)
        self.high: tuple[float, ...] = (device.drive.high,)
        self.safe: tuple[float, ...] = (device.drive.safe,)
        self._sensor = device.displacement
        self._seed = device.seed if seed is None else seed
        self._simulation, self._device = simulation, device
        self._adopt(simulation)
        self.reset()

    def inspection(self) -> OscillatorInspection:
        """Return a look into the device."""

        def rehearse(simulation: OscillatorSimulation) -> None:
            OscillatorPlant(simulation, self._device, 0).step(self.safe, 1e-3)

        return OscillatorInspection(self, self._simulation, rehearse)

    def put_in_force(self, simulation: OscillatorSimulation) -> None:
        """Go on as another equation from where it is; memories of mechanisms begin anew."""
        self._adopt(simulation)
        self._own = self._equation.own_start(self._z, self._v)
        self._path = SignalPath(self._acting)

    def _adopt(self, simulation: OscillatorSimulation) -> None:
        self._acting = acting(simulation)
        values = np.array([[parameter.value for parameter in simulation.parameters]])
        self._equation = Equation.of(simulation.parameters, [one for one, _ in self._acting], values)
        self._stiffness = float(self._equation.rows[STIFFNESS, 0])
        drive = self._device.drive
        self._steps_per_s = self._resolve(max(abs(drive.low), abs(drive.high)))

    def _resolve(self, largest_drive: float) -> float:
        """Return the steps per second that the fastest pole needs, at the sensor's range or the model's bound."""
        reach = self._sensor.range if math.isfinite(self._sensor.range) else 2.0 * self._equation.rest()
        drive = largest_drive if largest_drive < 1e6 else 0.0  # a device without limits of its own
        fast = self._equation.rates(reach, drive)[0] > FAST
        period_s = 1e-3 if fast else 1.0  # a plan refuses more steps in a period than records can have
        return self._equation.plan(period_s, reach, drive=drive).substeps / period_s

    def reset(self) -> None:
        """Reset to power-up: at rest where nothing drives it, clocks and noise from the start."""
        self._z, self._v = np.full(1, resting_place(self._equation)), np.zeros(1)
        self._own = self._equation.own_start(self._z, self._v)
        self._path = SignalPath(self._acting)
        self._noise = NoiseSource(self._seed)
        self._time_s = 0.0
        self._spot = self._sensed = float(self._z[0])
        self.diverged = False
        self._buffers: dict[int, tuple[FloatArray, FloatArray, FloatArray]] = {}

    def advance(self, levels: Sequence[float], dt_s: float) -> None:
        """Hold `levels` ([drive],) for `dt_s` [s]. Raises ValueError on what cannot be held."""
        (level,) = levels
        if not (math.isfinite(level) and dt_s >= 0.0):
            raise ValueError(f"drive {level!r} for {dt_s!r} s: needs a finite drive, a time >= 0")
        if dt_s > LONGEST_HOLD_S:
            self._time_s += dt_s - LONGEST_HOLD_S
            dt_s = LONGEST_HOLD_S
        end_s = self._time_s + dt_s
        for until_s in (*self._path.jumps(level, self._time_s, end_s), end_s):
            self._hold(level, until_s - self._time_s)

    def _hold(self, level: float, dt_s: float) -> None:
        """Hold a command over a time in which nothing jumps."""
        steps = max(1, math.ceil(dt_s * self._steps_per_s - 1e-6))
        h = dt_s / steps
        while steps > 0 and dt_s > 0.0 and not self.diverged:
            count = min(steps, BLOCK_STEPS)
            self._march(level, count, h)
            steps -= count

    def measure(self) -> tuple[tuple[float, ...], float]:
        """Return ((displacement,), reference displacement); NaN once the motion diverged or left the range."""
        if self.diverged:
            return (math.nan,), math.nan
        normals = self._noise.block[self._noise.next_row()]
        reading = self._path.to_reading(self._sensed, self._time_s)
        if not abs(reading) <= self._sensor.range:
            reading = math.nan
        reference = self._spot + self._sensor.reference_noise * float(normals[REFERENCE])
        return (reading + self._sensor.noise * float(normals[READING]),), reference

    def step(self, levels: Sequence[float], dt_s: float) -> tuple[tuple[float, ...], float]:
        """Call `advance`, then `measure`."""
        self.advance(levels, dt_s)
        return self.measure()

    @property
    def displacement(self) -> float:
        """The true displacement of the first mode now."""
        return float(self._z[0])

    @property
    def velocity(self) -> float:
        """Its rate [displacement's unit/s]."""
        return float(self._v[0])

    def _march(self, level: float, count: int, h: float) -> None:
        """March `count` steps of `h` under a held command."""
        commanded, out_z, out_v = self._buffer(count)
        commanded[:] = level
        nodes = self._path.to_equation(commanded, self._time_s, h)
        rows = self._equation.rows
        if rows[DRIFT, 0] != 0.0:  # the kernel's clock starts with each call
            rows[STIFFNESS, 0] = self._stiffness + rows[DRIFT, 0] * self._time_s
        self._equation.march(self._z, self._v, Driven(nodes, h), 1, (out_z, out_v), self._own)
        self._time_s += count * h
        if not np.abs(out_z).max() <= self._sensor.broken_above:  # NaN too
            self.diverged = True
            return
        self._spot, self._sensed = self._path.follow(out_z[:, 0], nodes, h)

    def _buffer(self, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return arrays for `count` steps, made once for each count: a loop asks for the same one again and again."""
        if count not in self._buffers:
            if len(self._buffers) > 16:
                self._buffers.clear()
            self._buffers[count] = np.empty((count, 3)), np.empty((count + 1, 1)), np.empty((count + 1, 1))
        return self._buffers[count]


def resting_place(equation: Equation) -> float:
    """Return the displacement at rest: zero, or if that is unstable the nearest equilibrium on the positive side."""
    stiffness, quadratic, cubic, quintic = equation.rows[[STIFFNESS, QUADRATIC, CUBIC, QUINTIC], 0]
    if stiffness >= 0.0:
        return 0.0
    roots = np.roots([quintic, 0.0, cubic, quadratic, stiffness])
    wells = roots.real[(np.abs(roots.imag) < 1e-9 * np.abs(roots)) & (roots.real > 0.0)]
    return float(wells.min(initial=math.inf)) if len(wells) else 0.0


def acting(simulation: OscillatorSimulation) -> list[tuple[OscillatorMechanism, Values]]:
    """Return the mechanisms that are not neutral, with their values. Raises NoStreamError for those without a form."""
    active: list[tuple[OscillatorMechanism, Values]] = []
    refused: list[str] = []
    for mechanism in simulation.mechanisms:
        own = [one for one in simulation.parameters if one.mechanism == mechanism.id]
        if all(one.value == one.declared.neutral for one in own if not one.declared.is_shape):
            continue
        values = {one.declared.name: one.value for one in own}
        if cannot_stream(mechanism, values):
            refused.append(mechanism.id)
        active.append((mechanism, values))
    if refused:
        several = len(refused) > 1
        names = ", ".join(f'"{name}"' for name in refused)
        raise NoStreamError(
            f"{'mechanisms' if several else 'mechanism'} {names} of the model {'have' if several else 'has'} no form "
            f"for a device that runs sample by sample; remove {'them' if several else 'it'} from the file, or use "
            "rtctl simulate",
            tuple(refused),
        )
    return active


def load_plant(path: Path, seed: int | None = None) -> OscillatorPlant:
    """Return the device of a model file; `seed` replaces that of its noise. Raises InputError with file and key."""
    model = read_model_file(path, "oscillator")
    device = read_device_table(model, path)
    units = {"drive": device.drive.unit, "displacement": device.displacement.unit}
    try:
        return OscillatorPlant(oscillator_simulation(model, units, str(path)), device, seed)
    except NoStreamError as error:
        raise NoStreamError(f"{path}: {error}", error.mechanisms) from None
    except (ValueError, InputError) as error:
        text = str(error)
        raise InputError(text if text.startswith(str(path)) else f"{path}: {text}") from None
