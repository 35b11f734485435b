"""The VO2 microactuator: current -> temperature -> two transitions -> resistance and deflection -> readings.

Two kernel calls a step: hold a current, read the instruments. The kind of hysteresis decides which kernel
holds; its memory travels as that kernel's last arguments. A device with effects (`effects`) has kernels of its own:
one without them stays the fast one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plant_sim.compiled_device import CompiledPlant
from plant_sim.kernels import direct, pack
from plant_sim.sensing import (
    OCTAVES,
    NoiseSource,
)
from plant_sim.vo2.device_file import DeviceFile
from plant_sim.vo2.domains import Domains, draw
from plant_sim.vo2.effects.changes import Stage, ordered
from plant_sim.vo2.effects.inspection import Vo2Inspection
from plant_sim.vo2.effects.kernel import (
    QUEUE,
    at_rest,
    hold_domains_with_effects,
    hold_limiting_loop_with_effects,
    outputs_with_effects,
    read_with_effects,
)
from plant_sim.vo2.effects.table import DRIFTS, Effects
from plant_sim.vo2.holds import (
    STATE,
    hold_domains,
    hold_limiting_loop,
    read,
    step_domains,
    step_limiting_loop,
    true_outputs,
)
from plant_sim.vo2.limiting_loop import cold_memory
from plant_sim.vo2.relays import banks
from rtctl.border.records import VO2

Array = NDArray[Any]


def held_current(levels: Sequence[float], dt_s: float) -> float:
    """Return the current [mA] of `levels`. Raises ValueError if it is not finite, or for a negative time `dt_s` [s]."""
    (current_mA,) = levels
    if not (math.isfinite(current_mA) and dt_s >= 0.0):
        raise ValueError(f"current {current_mA!r} mA for {dt_s!r} s: needs a finite current, a time >= 0")
    return current_mA


class Vo2Plant:
    """A simulated device (see `plant_sim.plant.Plant`). Commands and readings are float32 on every path."""

    profile = VO2

    def __init__(self, device: DeviceFile, seed: int | None = None) -> None:
        """Build the device; `seed` replaces that of the file's noise, the film stays the same specimen."""
        self.identity = device.plant.name
        self.low: tuple[float, ...] = (device.current.low,)
        self.high: tuple[float, ...] = (device.current.high,)
        self.safe: tuple[float, ...] = (device.current.safe,)
        self._device = device
        self._seed = device.plant.seed if seed is None else seed
        self._parameters = pack(device)
        hysteresis = device.hysteresis
        self._thresholds = draw(hysteresis) if isinstance(hysteresis, Domains) else None
        limiting = self._thresholds is None
        self.effects = device.effects
        """The effects in force."""
        self._stages = ordered(device.effects, device.changes)
        self._with_effects = device.effects.any or bool(self._stages)
        self._hold: Callable[..., None] = hold_limiting_loop if limiting else hold_domains
        if self._with_effects:
            self._hold = self._hold_with_effects()
        self._step_kernel: Callable[..., tuple[float, float]] = (
            step_limiting_loop if limiting else step_domains
        )
        self.reset()

    def inspection(self) -> Vo2Inspection:
        """Power up anew, with the kernels whose effects can be switched; return a look into the device."""
        self._with_effects, self._hold = True, self._hold_with_effects()
        self.reset()
        return Vo2Inspection(self)

    def set_effects(self, effects: Effects) -> None:
        """Put other effects in force, after `inspection`; the state stays, and what drifts begins to drift."""
        own, now = self._own[0], self._parameters["effects"][0]
        for name, value in effects:
            if name in DRIFTS and now[name] == 0.0 and value != 0.0:
                own[f"{name}_from"] = own["time"]
            now[name] = value
        if effects.swing_share != 0.0 and self.effects.swing_share == 0.0:
            own["swing"], own["speed"] = own["bent"], 0.0  # at rest where it is
        own["step"] = effects.longest_step_s(self._device.heating.time_constant)
        self.effects = effects

    def _hold_with_effects(self) -> Callable[..., None]:
        return hold_limiting_loop_with_effects if self._thresholds is None else hold_domains_with_effects

    def reset(self) -> None:
        """Reset to power-up: full cooling, clocks and noise from the start, changes that `[[changes]]` has to come."""
        self._to_come: list[Stage] = list(self._stages)
        if self._stages:
            self.effects = self._device.effects
            for name, value in self.effects:
                self._parameters["effects"][0][name] = value
        self._state = np.zeros(1, dtype=STATE)
        self._state["temperature"] = self._device.heating.ambient
        self._memory = self._cold_memory()
        if self._with_effects:
            ambient, heating = self._device.heating.ambient, self._device.heating
            step_s = self.effects.longest_step_s(heating.time_constant)
            resistance, deflection = true_outputs(self._parameters, self._state)
            self._own = at_rest(step_s, ambient, resistance, deflection)
            self._memory = (self._own, np.zeros((2, QUEUE)), *self._memory)
        self._noise = NoiseSource(self._seed)
        self._state["flicker"] = self._noise.block[self._noise.next_row(), :OCTAVES]
        self._film = (self._parameters, self._state, self._noise.block, *self._memory)
        if not self._with_effects:
            self._step = direct(self._step_kernel, 0.0, 0.0, 0, *self._film)
        self.advance((0.0,), 0.0)

    def _cold_memory(self) -> tuple[Array, ...]:
        hysteresis, ambient = self._device.hysteresis, self._device.heating.ambient
        if self._thresholds is not None:
            return tuple(banks(self._thresholds))
        assert not isinstance(hysteresis, Domains)
        loops = (hysteresis.electrical, hysteresis.structural)
        return (np.stack([cold_memory(loop, ambient) for loop in loops]),)

    def advance(self, levels: Sequence[float], dt_s: float) -> None:
        """Hold `levels` ([mA],) for `dt_s` [s]. Raises ValueError on a current that is not finite."""
        current_mA = held_current(levels, dt_s)
        while self._to_come and (left_s := self._to_come[0].at_s - self._own[0]["time"]) < dt_s:
            part_s = max(float(left_s), 0.0)
            self._hold(self._parameters, self._state, current_mA, part_s, *self._memory)
            dt_s -= part_s
            self.set_effects(self._to_come.pop(0).effects)
        self._hold(self._parameters, self._state, current_mA, dt_s, *self._memory)

    def measure(self) -> tuple[tuple[float, ...], float]:
        """Return readings: ((resistance [ohm],), deflection [um])."""
        noise = self._noise
        if self._with_effects:
            readings = read_with_effects(
                self._parameters, self._state, self._own, noise.block, noise.next_row()
            )
            return (readings[0],), readings[1]
        resistance, deflection = read(self._parameters, self._state, noise.block, noise.next_row())
        return (resistance,), deflection

    def step(self, levels: Sequence[float], dt_s: float) -> tuple[tuple[float, ...], float]:
        """Call `advance`, then `measure`."""
        if self._with_effects:
            self.advance(levels, dt_s)
            return self.measure()
        current_mA = held_current(levels, dt_s)
        resistance, deflection = self._step(current_mA, dt_s, self._noise.next_row(), *self._film)
        return (resistance,), deflection

    def compiled_plant(self) -> CompiledPlant | None:
        """Return the plant's part of a compiled exchange; None for a device with effects."""
        from plant_sim.vo2.compiled import exchange_of

        if self._with_effects:
            return None
        kernel = exchange_of(self._parameters.dtype, limiting=self._thresholds is None)
        return CompiledPlant(kernel, self._arrays, self._noise)

    def _arrays(self) -> tuple[Array, ...]:
        return self._film

    @property
    def temperature_degC(self) -> float:
        """The true temperature."""
        return float(self._state["temperature"][0])

    @property
    def electrical_fraction(self) -> float:
        """The part of the film that conducts as a metal."""
        return float(self._state["electrical"][0])

    @property
    def structural_fraction(self) -> float:
        """The part of the film that has the high-temperature structure."""
        return float(self._state["structural"][0])

    def truth(self) -> tuple[float, ...]:
        """Return what the device does, in the order of `plant_sim.vo2.effects.inspection.TRUTHS`."""
        resistance, deflection = self._outputs()
        acting_mA = float(self._own["acting"][0]) if self._with_effects else math.nan
        return (
            deflection, resistance, self.temperature_degC, acting_mA,
            self.electrical_fraction, self.structural_fraction,
        )  # fmt: skip

    @property
    def resistance_ohm(self) -> float:
        """The true resistance [ohm]."""
        return self._outputs()[0]

    @property
    def deflection_um(self) -> float:
        """The true deflection."""
        return self._outputs()[1]

    def _outputs(self) -> tuple[float, float]:
        if self._with_effects:
            return outputs_with_effects(self._parameters, self._own)
        return true_outputs(self._parameters, self._state)
