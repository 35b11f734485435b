"""A model file of equations as a loop sees it (`rtctl.border.equations.controlled.StateSpace`)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from plant_sim.equations.compiled.for_estimators import estimator_sources
from plant_sim.equations.device_profile import profile_of
from plant_sim.equations.device_table import InputLimits, Instrument, read_device_table
from plant_sim.equations.integration.steps import Places, outputs_at, rates_at
from plant_sim.equations.reading import read_equations, system_of
from plant_sim.equations.system import System
from rtctl.border.arrays import FloatArray
from rtctl.border.equations.controlled import LawSources, ModelOutput


class ControlledEquations:
    """Rates and outputs of a model file."""

    def __init__(self, path: Path) -> None:
        """Read the file. Raises InputError."""
        model = read_equations(path)
        device = read_device_table(model, path)
        self._system: System = system_of(model, str(path))
        names = [one.name for one in self._system.outputs]
        instruments = [device.outputs.get(name, Instrument()) for name in names]
        self.shown = names.index(device.reference) if device.reference else 0
        self.sensed = tuple(k for k, one in enumerate(instruments) if one.sensed)
        self.left_out = tuple(one.id for one in model.model.mechanisms)
        self.profile = profile_of(model, device, str(path))
        self.states = tuple(one.name for one in self._system.states)
        self.initial = np.array([one.initial for one in self._system.states])
        self.low = np.array([one.low for one in self._system.states])
        self.high = np.array([one.high for one in self._system.states])
        self.switched = np.array(self._system.discrete)
        self.noise = np.array([instruments[k].noise for k in self.sensed])
        limits = [device.inputs.get(one.name, InputLimits()) for one in self._system.inputs]
        self.command_range = np.array([(one.low, one.high) for one in limits])
        self.outputs = tuple(
            ModelOutput(
                one.name, one.unit, None if span.low is None or span.high is None else (span.low, span.high)
            )
            for one, span in zip(self._system.outputs, instruments, strict=True)
        )
        self.output_range = self.outputs[self.shown].reach
        self.parameters = np.array([one.value * one.factor for one in self._system.parameters])
        self.input_factors = np.array([one.factor for one in self._system.inputs])
        self.directions = np.array([float(one.direction) for one in self._system.events])

    @cached_property
    def sources(self) -> LawSources:
        """Return the laws as sources."""
        return estimator_sources(self._system)

    def input_si(self, levels: Sequence[float]) -> FloatArray:
        """Return commands (inputs,) in SI base units."""
        return np.asarray(np.asarray(levels, dtype=np.float64) * self.input_factors)

    def rates(self, x: FloatArray, levels: Sequence[float]) -> FloatArray:
        """Return the rates (m, states) [SI/s] of states `x` (m, states) under one set of commands."""
        return rates_at(self._system, self._places(x, levels), self.parameters)

    def readings(self, x: FloatArray, levels: Sequence[float]) -> FloatArray:
        """Return the readings (m, readings) of states `x` (m, states)."""
        return self.all_outputs(x, levels)[:, list(self.sensed)]

    def controlled(self, x: FloatArray, levels: Sequence[float]) -> FloatArray:
        """Return the controlled output (m,) of states `x` (m, states)."""
        return self.all_outputs(x, levels)[:, self.shown]

    def all_outputs(self, x: FloatArray, levels: Sequence[float]) -> FloatArray:
        """Return all outputs (m, outputs) of states `x` (m, states), each in its unit."""
        return outputs_at(self._system, self._places(x, levels), self.parameters)

    def _places(self, x: FloatArray, levels: Sequence[float]) -> Places:
        return Places(
            x, np.broadcast_to(self.input_si(levels), (len(x), len(self.input_factors))), np.zeros(len(x))
        )
