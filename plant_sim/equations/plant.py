"""A user's equations as a device: driven by one set of held commands after the other.

Its step is that of the fastest part along the way that it went, looked at anew from time to time.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from plant_sim.equations.compiled.kernels import march
from plant_sim.equations.compiled.passing import sides_at
from plant_sim.equations.device_profile import model_file_of, profile_of
from plant_sim.equations.device_table import DeviceTable, InputLimits, Instrument, read_device_table
from plant_sim.equations.inspection import EquationsInspection
from plant_sim.equations.integration.steps import Places, Plan, outputs_at, places_of, plan, slopes
from plant_sim.equations.reading import read_equations, system_of
from plant_sim.equations.simulation import ABSURD
from rtctl.border.arrays import FloatArray
from rtctl.border.equations.file import EquationsFile
from rtctl.border.errors import InputError

_log = logging.getLogger(__name__)
LONGEST_HOLD_S = 600.0
"""A device that nobody has looked at for longer is moved through the last so many seconds alone."""
SAME_STEPS = 64
"""Commands after which the steps are chosen anew."""
MOST_STEPS = 200_000
"""Steps in a call beyond which a device answers no more in time."""


class EquationsPlant:
    """A simulated device (see `plant_sim.plant.Plant`)."""

    def __init__(
        self, model: EquationsFile, device: DeviceTable, source: str, seed: int | None = None
    ) -> None:
        """Build the device; `seed` replaces that of its noise. Raises InputError where the model is wrong."""
        if model.model.mechanisms:
            raise InputError(
                f"{source}: model.mechanisms: a device is made of equations alone, and "
                f"{', '.join(one.id for one in model.model.mechanisms)} would be missing; write it as equations, or "
                "take the table out"
            )
        self._source, self._system = source, system_of(model, source)
        limits = [device.inputs.get(one.name, InputLimits()) for one in self._system.inputs]
        sensors = [device.outputs.get(one.name, Instrument()) for one in self._system.outputs]
        self._noises = np.array([one.noise for one in sensors])
        names = [one.name for one in self._system.outputs]
        self._shown = names.index(device.reference) if device.reference else 0
        self._sensed = [k for k, one in enumerate(sensors) if one.sensed]
        self.profile = profile_of(model, device, source)
        self.identity = device.name
        self.low = tuple(one.low for one in limits)
        self.high = tuple(one.high for one in limits)
        self.safe = tuple(one.safe for one in limits)
        self._seed = device.seed if seed is None else seed
        self._p = np.array([[one.value * one.factor] for one in self._system.parameters]).reshape(-1, 1)
        self.reset()

    def inspection(self) -> EquationsInspection:
        """Return a look into the device: its states and outputs, and its parameters, which can be set."""
        return EquationsInspection(self._system, self._p, self.truth)

    def truth(self) -> tuple[float, ...]:
        """Return outputs and states now, each in its unit; NaN once the motion diverged."""
        states = self._x[:, 0] / [one.factor for one in self._system.states]
        if self.diverged:
            return (math.nan,) * (len(self._system.outputs) + len(states))
        return (*self._outputs().tolist(), *states.tolist())

    def reset(self) -> None:
        """Reset to power-up: at the model's initial state, clocks and noise from the start."""
        self._x = np.array([[one.initial] for one in self._system.states])
        self._swing = np.maximum(np.abs(self._x[:, 0]), 1e-12)
        self._u = np.array([self.safe]) * [one.factor for one in self._system.inputs]
        self._time_s, self._calls = 0.0, 0
        self._random = np.random.default_rng(self._seed)
        self._side = sides_at(self._system, self._x, self._u[0], 0.0, self._p)
        self._plan, self._planned_s = Plan(1, False), 0.0
        self.diverged = False

    def advance(self, levels: Sequence[float], dt_s: float) -> None:
        """Hold `levels` (inputs,) for `dt_s` [s]. Raises ValueError on what cannot be held.

        Where events of the model follow each other without end, the motion is lost, and the log says so.
        """
        if not (all(map(math.isfinite, levels)) and dt_s >= 0.0):
            raise ValueError(
                f"levels {list(levels)!r} for {dt_s!r} s: finite levels and a time >= 0 are needed"
            )
        if dt_s > LONGEST_HOLD_S:
            self._time_s += dt_s - LONGEST_HOLD_S
            dt_s = LONGEST_HOLD_S
        self._u = np.array([levels]) * [one.factor for one in self._system.inputs]
        if dt_s == 0.0 or self.diverged:
            return
        if self._calls % SAME_STEPS == 0 or dt_s != self._planned_s:
            self._plan, self._planned_s = self._resolve(dt_s), dt_s
        self._calls += 1
        nodes = np.tile(self._u, (3, self._plan.substeps, 1))
        try:
            run = march(self._system, self._x, nodes, dt_s, self._plan, self._p, self._time_s, self._side)
        except ValueError as error:
            _log.error("%s: %s", self._source, error)
            self.diverged = True
            return
        ended, self._time_s = run[-1], self._time_s + dt_s
        self.diverged = not bool(np.all(np.abs(ended) < ABSURD))
        if not self.diverged:
            self._swing = np.maximum(self._swing, np.abs(ended - self._x)[:, 0])
            self._x = ended

    def _resolve(self, dt_s: float) -> Plan:
        """Return the steps of a hold from the slopes here and now; a model that is too fast keeps the most."""
        places = places_of(self._x.T, self._u, 1.0)
        try:
            found = plan(slopes(self._system, places, self._p[:, 0], self._swing), dt_s, None)
        except ValueError:
            return Plan(MOST_STEPS, False)
        return found._replace(substeps=min(found.substeps, MOST_STEPS))

    def measure(self) -> tuple[tuple[float, ...], float]:
        """Return readings of the outputs and the reference; NaN once the motion diverged."""
        noise = self._noises * self._random.standard_normal(len(self._noises))
        if self.diverged:
            return (math.nan,) * len(self._sensed), math.nan
        clean = self._outputs()
        return tuple((clean + noise)[self._sensed].tolist()), float(clean[self._shown])

    def _outputs(self) -> FloatArray:
        """Return the outputs (outputs,) now, each in its unit."""
        here = Places(self._x.T, self._u, np.array([self._time_s]))
        return np.asarray(outputs_at(self._system, here, self._p[:, 0])[0])

    def step(self, levels: Sequence[float], dt_s: float) -> tuple[tuple[float, ...], float]:
        """Call `advance`, then `measure`."""
        self.advance(levels, dt_s)
        return self.measure()


def load_plant(path: Path, seed: int | None = None) -> EquationsPlant:
    """Return the device of a model file, or of a plant file whose `plant.model` names one. Raises InputError."""
    path = model_file_of(path)
    model = read_equations(path)
    return EquationsPlant(model, read_device_table(model, path), str(path), seed)
