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
from plant_sim.kernels import compiled, direct, pack
from plant_sim.sensing import (
    OCTAVES,
    REFERENCE,
    WHITE,
    NoiseSource,
    drift,
    read_deflection,
    read_resistance,
)
from plant_sim.vo2.deflection import deflection_at
from plant_sim.vo2.device_file import DeviceFile
from plant_sim.vo2.domains import ELECTRICAL, STRUCTURAL, Domains, Floats, draw
from plant_sim.vo2.effects_kernel import (
    QUEUE,
    at_rest,
    hold_domains_with_effects,
    hold_limiting_loop_with_effects,
    outputs_with_effects,
    read_with_effects,
)
from plant_sim.vo2.heating import heat
from plant_sim.vo2.limiting_loop import cold_memory, follow
from plant_sim.vo2.relays import banks, settle
from plant_sim.vo2.resistance import resistance_at
from rtctl.border.records import VO2

Array = NDArray[Any]

STATE = np.dtype(
    [
        ("temperature", np.float64),  # degC
        ("electrical", np.float64),  # fractions
        ("structural", np.float64),
        ("unread", np.float64),  # s, since the last reading
        ("flicker", np.float64, (OCTAVES,)),  # standard deviations
    ]
)


# 9 parameters because a kernel takes its arrays one by one
@compiled
def hold_domains(  # noqa: PLR0913
    parameters: Array,
    state: Array,
    current_mA: float,
    dt_s: float,
    t_up: Floats,
    t_down: Floats,
    by_t_down: Array,
    is_up: Array,
    counters: Array,
) -> None:
    """Hold a current on a device whose film is a population of domains."""
    p, s = parameters[0], state[0]
    s.temperature = heat(p.heating, s.temperature, np.float64(np.float32(current_mA)), dt_s)
    s.unread += dt_s
    T, coupling = s.temperature, p.hysteresis.coupling
    e, m = ELECTRICAL, STRUCTURAL
    s.electrical = settle(t_up[e], t_down[e], by_t_down[e], is_up[e], counters[e], T, coupling)
    s.structural = settle(t_up[m], t_down[m], by_t_down[m], is_up[m], counters[m], T, coupling)


@compiled
def hold_limiting_loop(
    parameters: Array, state: Array, current_mA: float, dt_s: float, memory: Floats
) -> None:
    """Hold a current on a device whose film follows limiting loops."""
    p, s = parameters[0], state[0]
    s.temperature = heat(p.heating, s.temperature, np.float64(np.float32(current_mA)), dt_s)
    s.unread += dt_s
    s.electrical = follow(p.hysteresis.electrical, memory[ELECTRICAL], s.temperature)
    s.structural = follow(p.hysteresis.structural, memory[STRUCTURAL], s.temperature)


@compiled
def true_outputs(parameters: Array, state: Array) -> tuple[float, float]:
    """Return resistance [ohm] and deflection [um], without instruments."""
    p, s = parameters[0], state[0]
    resistance = resistance_at(p.resistance, s.temperature, s.electrical)
    deflection = deflection_at(p.deflection, s.temperature - p.heating.ambient, s.structural)
    return resistance, deflection


@compiled
def read(parameters: Array, state: Array, normals: Array, row: int) -> tuple[float, float]:
    """Return both instruments' readings [ohm], [um]; consume a row of `normals`."""
    p, s = parameters[0], state[0]
    resistance, deflection = true_outputs(parameters, state)
    flicker = drift(s.flicker, normals[row], s.unread)
    s.unread = 0.0
    return (
        read_resistance(p.sensing, resistance, flicker, normals[row, WHITE]),
        read_deflection(p.sensing, deflection, normals[row, REFERENCE]),
    )


# 11 parameters because a kernel takes its arrays one by one
@compiled
def step_domains(  # noqa: PLR0913
    current_mA: float,
    dt_s: float,
    row: int,
    parameters: Array,
    state: Array,
    normals: Array,
    t_up: Floats,
    t_down: Floats,
    by_t_down: Array,
    is_up: Array,
    counters: Array,
) -> tuple[float, float]:
    """Call `hold_domains`, then `read`, for the price of one call."""
    hold_domains(parameters, state, current_mA, dt_s, t_up, t_down, by_t_down, is_up, counters)
    return read(parameters, state, normals, row)


@compiled
def step_limiting_loop(
    current_mA: float,
    dt_s: float,
    row: int,
    parameters: Array,
    state: Array,
    normals: Array,
    memory: Floats,
) -> tuple[float, float]:
    """Call `hold_limiting_loop`, then `read`, for the price of one call."""
    hold_limiting_loop(parameters, state, current_mA, dt_s, memory)
    return read(parameters, state, normals, row)


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
        self._with_effects = device.effects.any
        self._hold: Callable[..., None] = hold_limiting_loop if limiting else hold_domains
        if self._with_effects:
            self._hold = hold_limiting_loop_with_effects if limiting else hold_domains_with_effects
        self._step_kernel: Callable[..., tuple[float, float]] = (
            step_limiting_loop if limiting else step_domains
        )
        self.reset()

    def reset(self) -> None:
        """Reset to power-up: full cooling, clocks and noise from the start."""
        self._state = np.zeros(1, dtype=STATE)
        self._state["temperature"] = self._device.heating.ambient
        self._memory = self._cold_memory()
        if self._with_effects:
            ambient, heating = self._device.heating.ambient, self._device.heating
            step_s = self._device.effects.longest_step_s(heating.time_constant)
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
        self._hold(self._parameters, self._state, held_current(levels, dt_s), dt_s, *self._memory)

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
