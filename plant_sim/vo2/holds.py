"""Kernels of one hold of the VO2 microactuator: move the state on under a current, read the instruments."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from plant_sim.kernels import compiled
from plant_sim.sensing import OCTAVES, REFERENCE, WHITE, drift, read_deflection, read_resistance
from plant_sim.vo2.deflection import deflection_at
from plant_sim.vo2.domains import ELECTRICAL, STRUCTURAL, Floats
from plant_sim.vo2.heating import heat
from plant_sim.vo2.limiting_loop import follow
from plant_sim.vo2.relays import settle
from plant_sim.vo2.resistance import resistance_at

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
