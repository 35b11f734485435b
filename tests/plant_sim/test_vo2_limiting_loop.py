"""The compiled limiting-loop model against its equations, written out with g and the inverse tanh."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant_sim.kernels import pack
from plant_sim.vo2.limiting_loop import Loop, cold_memory, follow

W, TC, BETA, GAMMA = 7.19, 332.81 - 273.15, 0.2528, 0.956

LOOP = Loop.model_validate(
    {"centre": "332.81 K", "width": "7.19 K", "steepness": "0.2528 1/K", "proximity": 0.956}
)


def compiled_fractions(temperatures: list[float]) -> list[float]:
    parameters, memory = pack(LOOP), cold_memory(LOOP, 23.0)
    return [follow(parameters[0], memory, temperature) for temperature in temperatures]


def written_out(temperatures: list[float]) -> list[float]:
    delta, Tr, Tpr, last, g = 1.0, 23.0, 0.0, 23.0, 1.0
    fractions = []
    for T in temperatures:
        if (T - last) * delta < 0.0:
            delta, Tr = -delta, last
            Tpr = delta * W / 2 + TC - math.atanh(2.0 * g - 1.0) / BETA - Tr
        x = (T - Tr) / Tpr if Tpr else 0.0
        P = 0.5 * (1.0 - math.sin(GAMMA * x)) * (1.0 + math.tanh(math.pi**2 - 2.0 * math.pi * x))
        g = 0.5 + 0.5 * math.tanh(BETA * (delta * W / 2 + TC - T - Tpr * P))
        last = T
        fractions.append(1.0 - g)
    return fractions


@given(st.lists(st.floats(50.0, 72.0), min_size=1, max_size=8, unique_by=lambda T: round(T, 3)))
def test_every_path_is_that_of_the_equations(temperatures):
    assert compiled_fractions(temperatures) == pytest.approx(written_out(temperatures), abs=1e-7)


def test_heating_from_cold_follows_the_limiting_branch():
    temperatures = np.linspace(24.0, 95.0, 200)
    expected = 0.5 - 0.5 * np.tanh(BETA * (W / 2 + TC - temperatures))
    assert compiled_fractions(temperatures.tolist()) == pytest.approx(expected.tolist(), abs=1e-12)


def test_a_full_cooling_follows_the_other_branch_a_width_below():
    temperatures = np.linspace(110.0, 40.0, 200)
    fractions = compiled_fractions([110.0, *temperatures[1:].tolist()])[1:]
    expected = 0.5 - 0.5 * np.tanh(BETA * (-W / 2 + TC - temperatures[1:]))
    assert fractions[30:] == pytest.approx(expected[30:].tolist(), abs=1e-6)


def test_a_reversal_is_continuous():
    at_turn, just_after = compiled_fractions([64.0, 64.0 - 1e-9])
    assert just_after == pytest.approx(at_turn, abs=1e-8)


def test_minor_loops_do_not_close():
    first, _, second = compiled_fractions([63.0, 60.0, 63.0])
    assert abs(second - first) > 0.005
