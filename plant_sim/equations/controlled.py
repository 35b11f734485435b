"""A model file of equations as a loop sees it (`rtctl.border.equations.controlled.StateSpace`)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from plant_sim.equations.compiled.kernels import law_of
from plant_sim.equations.device_profile import profile_of
from plant_sim.equations.device_table import InputLimits, Instrument, read_device_table
from plant_sim.equations.language.evaluation import evaluate
from plant_sim.equations.language.functions import TIME
from plant_sim.equations.reading import read_equations, system_of
from plant_sim.equations.system import Output, System
from rtctl.border.arrays import FloatArray


class ControlledEquations:
    """Rates and outputs of a model file."""

    def __init__(self, path: Path) -> None:
        """Read the file. Raises InputError."""
        model = read_equations(path)
        device = read_device_table(model, path)
        self._system: System = system_of(model, str(path))
        outputs = {one.name: one for one in self._system.outputs}
        instruments = {name: device.outputs.get(name, Instrument()) for name in outputs}
        shown = device.reference or next(iter(outputs))
        self._sensed = [one for name, one in outputs.items() if instruments[name].sensed]
        self._shown = outputs[shown]
        self.left_out = tuple(one.id for one in model.model.mechanisms)
        self.profile = profile_of(model, device, str(path))
        self.initial = np.array([one.initial for one in self._system.states])
        self.low = np.array([one.low for one in self._system.states])
        self.high = np.array([one.high for one in self._system.states])
        self.noise = np.array([instruments[one.name].noise for one in self._sensed])
        limits = [device.inputs.get(one.name, InputLimits()) for one in self._system.inputs]
        self.command_range = np.array([(one.low, one.high) for one in limits])
        span = instruments[shown]
        self.output_range = None if span.low is None or span.high is None else (span.low, span.high)
        self.parameters = np.array([[one.value * one.factor] for one in self._system.parameters]).reshape(
            -1, 1
        )
        self._factors = np.array([one.factor for one in self._system.inputs])

    @property
    def law(self) -> Any:
        """Return the compiled rates, compiled at the first use of the model on a machine."""
        return law_of(self._system)

    def input_si(self, levels: Sequence[float]) -> FloatArray:
        """Return commands (inputs,) in SI base units."""
        return np.asarray(np.asarray(levels, dtype=np.float64) * self._factors)

    def rates(self, x: FloatArray, levels: Sequence[float]) -> FloatArray:
        """Return the rates (m, states) [SI/s] of states `x` (m, states) under one set of commands."""
        trees = tuple(one.rate for one in self._system.states)
        values = self._values(x, levels, trees)
        return np.stack([np.broadcast_to(evaluate(tree, values), len(x)) for tree in trees], axis=1)

    def readings(self, x: FloatArray, levels: Sequence[float]) -> FloatArray:
        """Return the readings (m, readings) of states `x` (m, states)."""
        return np.stack(self._read(x, levels, self._sensed), axis=1)

    def controlled(self, x: FloatArray, levels: Sequence[float]) -> FloatArray:
        """Return the controlled output (m,) of states `x` (m, states)."""
        return self._read(x, levels, [self._shown])[0]

    def _read(self, x: FloatArray, levels: Sequence[float], outputs: Sequence[Output]) -> list[FloatArray]:
        values = self._values(x, levels, tuple(one.value for one in outputs))
        return [np.broadcast_to(evaluate(one.value, values), len(x)) / one.factor for one in outputs]

    def _values(self, x: FloatArray, levels: Sequence[float], trees: tuple[Any, ...]) -> dict[str, Any]:
        """Return the number or array of each name on which `trees` depend."""
        values: dict[str, Any] = {TIME: 0.0}
        values |= {one.name: x[:, k] for k, one in enumerate(self._system.states)}
        values |= dict(zip((one.name for one in self._system.inputs), self.input_si(levels), strict=True))
        values |= {one.name: self.parameters[k, 0] for k, one in enumerate(self._system.parameters)}
        for name, tree in self._system.needed_terms(trees).items():
            values[name] = evaluate(tree, values)
        return values
