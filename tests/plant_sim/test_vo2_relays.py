"""The sorted bank of relays is the plain one, and has the memory that relays have."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant_sim.vo2.domains import Domains, Thresholds, draw, lattice
from plant_sim.vo2.relays import Banks, banks, settle

TEMPERATURES = st.lists(st.floats(40.0, 95.0), min_size=1, max_size=12)
COUPLINGS = st.sampled_from([0.0, 0.6, 3.0])


def film(count: int = 512) -> Domains:
    return Domains.model_validate(
        {
            "kind": "domains",
            "seed": 5,
            "count": count,
            "centre": "68 degC",
            "spread": "3 K",
            "width": "7 K",
            "width_spread": 0.4,
            "width_correlation": 0.5,
            "reversible": 0.1,
            "coupling": "0.6 K",
            "structural_offset": "1 K",
            "structural_scatter": "0.8 K",
            "structural_width_ratio": 1.1,
        }
    )


THRESHOLDS = draw(film())


class Bank:
    """One bank (the electrical one) of the compiled relays."""

    def __init__(self, coupling: float) -> None:
        self.relays: Banks = banks(THRESHOLDS)
        self.coupling = coupling

    def at(self, temperature: float) -> float:
        return settle(*(array[0] for array in self.relays), temperature, self.coupling)

    def through(self, temperatures: list[float]) -> list[float]:
        return [self.at(temperature) for temperature in temperatures]


def plainly(thresholds: Thresholds, coupling: float, temperatures: list[float]) -> list[float]:
    """Every relay asked at every temperature, until none switches."""
    t_up, t_down = thresholds.t_up[0], thresholds.t_down[0]
    is_up = np.zeros(t_up.size, dtype=bool)
    fractions = []
    for temperature in temperatures:
        while True:
            field = temperature + coupling * (is_up.sum() / is_up.size - 0.5)
            switched = (is_up | (t_up <= field)) & ~(t_down >= field)
            if (switched == is_up).all():
                break
            is_up = switched
        fractions.append(is_up.sum() / is_up.size)
    return fractions


@given(temperatures=TEMPERATURES, coupling=COUPLINGS)
def test_sorted_relays_switch_as_relays_asked_one_by_one(temperatures, coupling):
    assert Bank(coupling).through(temperatures) == plainly(THRESHOLDS, coupling, temperatures)


def test_all_are_down_far_below_and_up_far_above():
    assert Bank(0.6).through([23.0, 120.0, 23.0]) == [0.0, 1.0, 0.0]


@given(inner=TEMPERATURES, coupling=COUPLINGS, low=st.floats(55.0, 66.0), high=st.floats(68.0, 80.0))
def test_return_to_an_extremum_forgets_the_excursion(inner, coupling, low, high):
    within = [min(max(temperature, low), high) for temperature in inner]
    bank = Bank(coupling)
    bank.at(high)
    at_low = bank.at(low)
    bank.through(within)
    assert bank.at(low) == at_low

    bank = Bank(coupling)
    at_high = bank.at(high)
    bank.through([low, *within])
    assert bank.at(high) == at_high


def height_of_minor_loop(coupling: float, history: list[float]) -> float:
    bank = Bank(coupling)
    bank.through(history)
    bottom, top = bank.through([66.0, 71.0, 66.0])[1:]
    return bottom - top


@given(history=TEMPERATURES)
def test_minor_loops_between_the_same_temperatures_are_congruent_without_coupling(history):
    assert height_of_minor_loop(0.0, history) == height_of_minor_loop(0.0, [23.0])


def test_coupling_breaks_congruency():
    assert height_of_minor_loop(3.0, [95.0]) != pytest.approx(height_of_minor_loop(3.0, [23.0]), rel=0.02)


def test_coupling_steepens_the_heating_branch():
    def width_of_transition(coupling: float) -> float:
        temperatures = np.linspace(60.0, 85.0, 2501)
        fractions = Bank(coupling).through(temperatures.tolist())
        ten, ninety = np.interp([0.1, 0.9], fractions, temperatures)
        return float(ninety - ten)

    assert width_of_transition(3.0) == pytest.approx(width_of_transition(0.0) - 0.8 * 3.0, abs=0.1)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_draw_is_even_along_every_dimension(seed):
    """Independent draws of this number would be off by about 1/sqrt(4096), 64 spacings."""
    count = 4096
    for points in lattice(count, 4, np.random.default_rng(seed)):
        assert np.abs(np.sort(points) - (np.arange(count) + 0.5) / count).max() < 12.0 / count


def test_the_draw_has_the_mean_the_width_and_the_correlation_of_its_table():
    thresholds = draw(film(4096).model_copy(update={"reversible": 0.0}))
    width = thresholds.t_up[0] - thresholds.t_down[0]
    centre = 0.5 * (thresholds.t_up[0] + thresholds.t_down[0])
    assert width.mean() == pytest.approx(7.0, rel=0.01)
    assert np.log(width).std() == pytest.approx(0.4, rel=0.01)
    assert centre.mean() == pytest.approx(68.0, abs=0.02)
    assert centre.std() == pytest.approx(3.0, rel=0.01)
    assert np.corrcoef(np.log(width), centre)[0, 1] == pytest.approx(0.5, abs=0.01)
    lag = 0.5 * (thresholds.t_up[1] + thresholds.t_down[1]) - centre
    assert lag.mean() == pytest.approx(1.0, abs=0.01)
    assert lag.std() == pytest.approx(0.8, rel=0.01)
    assert (thresholds.t_down < thresholds.t_up).all()
