"""Mechanisms in hardware that runs sample by sample, with their memory from one held drive to the next.

A mechanism of the equation (terms, memory) needs nothing here, one without memory acts on the instants of a step as it
does on a record's. Those with a state of their own have it below, from rest. A mechanism that has neither form is
refused: a device that leaves an effect out in silence would be worse than none. A held drive has no rate of change.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import Protocol

import numpy as np

from plant_sim.oscillator.equation.binding import bind
from plant_sim.oscillator.equation.terms import DAMPING, GAIN, STIFFNESS, TERMS
from plant_sim.oscillator.integration.holds import compiled
from plant_sim.oscillator.integration.play import follow_play
from plant_sim.oscillator.integration.splitting import no_kick, propagator, splitting
from plant_sim.oscillator.integration.turning_points import arrive, farthest_before, follow_turning_points
from plant_sim.oscillator.mechanism import Driven, Moved, OscillatorMechanism, Values
from plant_sim.oscillator.mechanisms.drive.gain_drift import amplified
from rtctl.border.arrays import FloatArray

_SAME_S = 1e-9
"""Time below which two instants are one [s]: a step of a picosecond would resolve rounding only."""


class DriveStage(Protocol):
    """A stage of the drive's path with memory."""

    def pass_on(self, nodes: FloatArray, start_s: float, h: float) -> FloatArray:
        """Return the drive (steps, 3) behind it, of steps of `h` [s] from the device's time `start_s` on."""
        ...


class SensorStage(Protocol):
    """A stage of the reading's path with memory."""

    def pass_on(self, reading: FloatArray, nodes: FloatArray, h: float) -> FloatArray:
        """Return the reading (steps + 1,) behind it at the ends of the steps of `nodes`; the first is the start."""
        ...


class DelayLine:
    """The held levels of the past, and when each started."""

    def __init__(self, delay_s: float) -> None:
        self._delay_s = delay_s
        self._changes: deque[tuple[float, float]] = deque([(-math.inf, 0.0)])

    def command(self, level: float, start_s: float) -> None:
        """Hold `level` from the device's time `start_s` on."""
        if level != self._changes[-1][1]:
            self._changes.append((start_s, level))

    def jumps(self, start_s: float, end_s: float) -> list[float]:
        """Return when, between the two times, a change of the past arrives."""
        arrivals = (time + self._delay_s for time, _ in self._changes)
        return [time for time in arrivals if start_s + _SAME_S < time < end_s - _SAME_S]

    def pass_on(self, nodes: FloatArray, start_s: float, h: float) -> FloatArray:
        """Return what was held so much earlier; between two jumps it is one level."""
        then = start_s + 0.5 * h * len(nodes) - self._delay_s
        while len(self._changes) > 1 and self._changes[1][0] <= then:
            self._changes.popleft()
        return np.full_like(nodes, self._changes[0][1])


class DriveLag:
    """A first-order lag of the drive."""

    def __init__(self, values: Values) -> None:
        self._time_constant_s = values["time_constant"]
        self._state = np.zeros(1)

    def pass_on(self, nodes: FloatArray, start_s: float, h: float) -> FloatArray:
        """Return the lagging drive; exact for a drive that is constant over each step."""
        behind = np.empty_like(nodes)
        _follow_held(self._state, nodes, math.exp(-0.5 * h / self._time_constant_s), behind)
        return behind


class Backlash:
    """Play between the drive and what it moves."""

    def __init__(self, values: Values) -> None:
        self._width = values["width"]
        self._state = np.zeros(1)

    def pass_on(self, nodes: FloatArray, start_s: float, h: float) -> FloatArray:
        """Return the drive behind the play."""
        behind = np.empty_like(nodes)
        follow_play(self._state, nodes, self._width, behind)
        return behind


class Hysteresis:
    """Hysteresis between the drive and what it moves."""

    def __init__(self, values: Values) -> None:
        self._density, self._fading = values["density"], values["fading"]
        left = values["remanence"]
        before = farthest_before(left, self._density, self._fading)
        self._state = arrive(0.0, left, before, self._density, self._fading)

    def pass_on(self, nodes: FloatArray, start_s: float, h: float) -> FloatArray:
        """Return the drive behind the hysteresis."""
        more = np.empty_like(nodes)
        follow_turning_points(self._state, nodes, self._density, self._fading, more)
        return nodes + more


class GainDrift:
    """A gain of the drive that changes from power-up on."""

    def __init__(self, values: Values) -> None:
        self._rate, self._settling_s = values["rate"], values["settling_time"]

    def pass_on(self, nodes: FloatArray, start_s: float, h: float) -> FloatArray:
        """Return the drive at the gain of its time."""
        return amplified(nodes, self._rate, self._settling_s, start_s, h)


class SensorLag:
    """A first-order lag of the reading."""

    def __init__(self, values: Values) -> None:
        self._time_constant_s = values["time_constant"]
        self._state = np.full(1, math.nan)

    def pass_on(self, reading: FloatArray, nodes: FloatArray, h: float) -> FloatArray:
        """Return the lagging reading, settled at first; exact for a motion that is linear over each step."""
        behind = np.empty_like(reading)
        _follow_linear(self._state, reading, h / self._time_constant_s, behind)
        return behind


class HighPass:
    """A first-order high-pass of the reading."""

    def __init__(self, values: Values) -> None:
        self._rate = values["rate"]
        self._state = np.zeros(1)

    def pass_on(self, reading: FloatArray, nodes: FloatArray, h: float) -> FloatArray:
        """Return the reading without what is slow; exact for a motion that is linear over each step."""
        slow = np.empty_like(reading)
        _follow_linear(self._state, reading, h * self._rate, slow)
        fast: FloatArray = reading - slow
        return fast


class SecondMode:
    """A linear mode that the drive moves too and the sensor sees."""

    def __init__(self, values: Values) -> None:
        rate = 2.0 * math.pi * values["frequency"]
        self._rows = np.zeros((len(TERMS), 1))
        self._rows[GAIN], self._rows[STIFFNESS] = values["gain"], rate**2
        self._rows[DAMPING] = 2.0 * values["damping_ratio"] * rate
        self._q, self._rate = np.zeros(1), np.zeros(1)
        self._step_s, self._propagator = 0.0, np.empty(0)
        self._march = bind(splitting, kick=no_kick)

    def pass_on(self, reading: FloatArray, nodes: FloatArray, h: float) -> FloatArray:
        """Return the reading of both modes; exact for a drive that is a parabola over each step."""
        if h != self._step_s:
            self._step_s, self._propagator = h, propagator(self._rows, h)
        q, rate = np.empty((len(reading), 1)), np.empty((len(reading), 1))
        self._march(self._q, self._rate, nodes, 1, self._propagator, q, rate)
        both: FloatArray = reading + q[:, 0]
        return both


class Crosstalk:
    """The held drive in the reading."""

    def __init__(self, values: Values) -> None:
        self._gain = values["gain"]

    def pass_on(self, reading: FloatArray, nodes: FloatArray, h: float) -> FloatArray:
        """Return the reading with the drive that is held until each instant."""
        both: FloatArray = reading + self._gain * np.append(nodes[:1, 0], nodes[:, 2])
        return both


class _WithoutMemory:
    """A mechanism that acts on each instant by itself, as it does on a record."""

    def __init__(self, mechanism: OscillatorMechanism, values: Values) -> None:
        self._mechanism, self._values = mechanism, values

    def of_drive(self, nodes: FloatArray, start_s: float, h: float) -> FloatArray:
        """Return the drive behind it."""
        assert self._mechanism.drive is not None
        return self._mechanism.drive(Driven(nodes, h), self._values).nodes

    def of_reading(self, readings: FloatArray, times_s: FloatArray) -> FloatArray:
        """Return the readings (instants,) behind it, at the device's times."""
        assert self._mechanism.sensor is not None
        moved = Moved(
            displacement=readings, velocity=np.zeros_like(readings), time_s=times_s, period_s=1.0,
            drive=_NO_DRIVE, substeps=1,
        )  # fmt: skip
        return self._mechanism.sensor(moved, self._values).displacement


_NO_DRIVE = Driven(np.zeros((0, 3)), 1.0)
DELAYS: dict[str, Callable[[Values], float]] = {
    "drive.delay": lambda values: values["delay"],
    "timing.skew": lambda values: -values["late"],
}
"""Mechanisms by which the response is late, and by how much [s]."""
DRIVE_STAGES: dict[str, Callable[[Values], DriveStage]] = {
    "drive.delay": lambda values: DelayLine(DELAYS["drive.delay"](values)),
    "drive.lag": DriveLag,
    "input.gain_drift": GainDrift,
    "timing.skew": lambda values: DelayLine(DELAYS["timing.skew"](values)),
    "actuator.backlash": Backlash,
    "actuator.hysteresis": Hysteresis,
}
SENSOR_STAGES: dict[str, Callable[[Values], SensorStage]] = {
    "mode.second": SecondMode,
    "sensor.crosstalk": Crosstalk,
    "sensor.highpass": HighPass,
    "sensor.lag": SensorLag,
}
WITHOUT_MEMORY = frozenset(
    {"drive.offset", "drive.deadband", "drive.saturation", "drive.harmonics"}
    | {"sensor.saturation", "sensor.offset", "sensor.hum", "sensor.drift", "sensor.quantisation"}
)


def cannot_stream(mechanism: OscillatorMechanism, values: Values) -> bool:
    """Return whether a mechanism acts outside the equation and has no form here: none reads what is yet to come."""
    outside = mechanism.acts_before_the_equation or mechanism.sensor is not None
    known = DRIVE_STAGES.keys() | SENSOR_STAGES.keys() | WITHOUT_MEMORY
    is_ahead = mechanism.id == "timing.skew" and values["late"] > 0.0
    is_ahead |= mechanism.id == "sensor.crosstalk" and values["before"] != 1.0
    return is_ahead or (outside and mechanism.id not in known)


class Path:
    """The path from a command to the equation, and from the motion to the reading; from rest."""

    def __init__(self, mechanisms: list[tuple[OscillatorMechanism, Values]]) -> None:
        ordered = sorted(mechanisms, key=lambda one: one[0].stage)
        self._delays: list[DelayLine] = []
        self._drive: list[Callable[[FloatArray, float, float], FloatArray]] = []
        self._motion: list[SensorStage] = []
        self._reading: list[Callable[[FloatArray, FloatArray], FloatArray]] = []
        # what is late passes first, as it is in a record: a delay acts between samples, the rest on the instants
        for mechanism, values in sorted(ordered, key=lambda one: one[0].input is None):
            if mechanism.id in DRIVE_STAGES:
                stage = DRIVE_STAGES[mechanism.id](values)
                self._drive.append(stage.pass_on)
                self._delays += [stage] if isinstance(stage, DelayLine) else []
            elif mechanism.drive is not None:
                self._drive.append(_WithoutMemory(mechanism, values).of_drive)
            if mechanism.id in SENSOR_STAGES:
                self._motion.append(SENSOR_STAGES[mechanism.id](values))
            elif mechanism.sensor is not None:
                self._reading.append(_WithoutMemory(mechanism, values).of_reading)

    def jumps(self, level: float, start_s: float, end_s: float) -> list[float]:
        """Return when the acting drive jumps while a command is held from `start_s` to `end_s`."""
        for delay in self._delays:
            delay.command(level, start_s)
        return [time for delay in self._delays for time in delay.jumps(start_s, end_s)]

    def to_equation(self, nodes: FloatArray, start_s: float, h: float) -> FloatArray:
        """Return the drive (steps, 3) that acts."""
        for stage in self._drive:
            nodes = stage(nodes, start_s, h)
        return nodes

    def follow(self, displacement: FloatArray, nodes: FloatArray, h: float) -> tuple[float, float]:
        """Return the true position of the sensor's spot, and what reaches the sensor, at the end of a stretch."""
        spot, reading = self.trace(displacement, nodes, h)
        return float(spot[-1]), float(reading[-1])

    def trace(self, displacement: FloatArray, nodes: FloatArray, h: float) -> tuple[FloatArray, FloatArray]:
        """Return the same at every instant (steps + 1,) of the stretch."""
        spot = reading = displacement
        for stage in self._motion:
            reading = stage.pass_on(reading, nodes, h)
            if isinstance(stage, SecondMode):
                spot = reading
        return spot, reading

    def to_reading(self, reading: float, time_s: float) -> float:
        """Return the sensor's reading."""
        return float(self.to_readings(np.array([reading]), np.array([time_s]))[0])

    def to_readings(self, readings: FloatArray, times_s: FloatArray) -> FloatArray:
        """Return the sensor's readings at several instants."""
        for stage in self._reading:
            readings = stage(readings, times_s)
        return readings


@compiled
def _follow_held(state: FloatArray, nodes: FloatArray, decay_half: float, out: FloatArray) -> None:
    """Follow x' = (u - x) / time constant at the start, middle and end of each step."""
    x = state[0]
    for i in range(len(nodes)):
        u = nodes[i, 0]
        out[i, 0] = x
        x = u + (x - u) * decay_half
        out[i, 1] = x
        x = u + (x - u) * decay_half
        out[i, 2] = x
    state[0] = x


@compiled
def _follow_linear(state: FloatArray, motion: FloatArray, ratio: float, out: FloatArray) -> None:
    """Follow y' = (z - y) / time constant, z linear over each step of `ratio` time constants."""
    y = state[0]
    if math.isnan(y):
        y = motion[0]
    out[0] = y
    decay = math.exp(-ratio)
    slope = 1.0 - (1.0 - decay) / ratio
    for i in range(len(motion) - 1):
        y = decay * y + (1.0 - decay) * motion[i] + slope * (motion[i + 1] - motion[i])
        out[i + 1] = y
    state[0] = y
