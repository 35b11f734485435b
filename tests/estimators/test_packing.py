"""A packed memory is the same parameters and states: read back whole, written through, stepped to the same bits."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.estimators.composite import composite_step, packed_composite_step
from rtctl.estimators.gap_free import gap_free_composite_step, packed_gap_free_composite_step
from rtctl.estimators.observer import ObserverParams, filter_start, observer_step, packed_observer_step
from rtctl.hysteresis.egpi import EgpiModel
from rtctl.hysteresis.gap_free import GapFreeModel
from rtctl.hysteresis.gpi import GpiModel
from rtctl.hysteresis.gpi_inverse import GpiInverse
from rtctl.hysteresis.packing import (
    array_at,
    egpi_at,
    gap_free_at,
    gpi_inverse_at,
    number_at,
    pack,
    preisach_at,
)
from rtctl.hysteresis.preisach.model import PreisachModel

RADII = np.arange(6) / 6.0
PLAYS = {
    "p": np.linspace(3.0, 8.0, 6), "r": RADII, "a_R": np.linspace(0.9, 1.3, 6), "b_R": np.linspace(-7.4, -7.9, 6),
    "a_L": np.linspace(0.95, 1.35, 6), "b_L": np.linspace(-7.0, -7.5, 6), "v_low": 3.5, "v_high": 8.5,
}  # fmt: skip
EGPI = EgpiModel(**PLAYS, c2=-1.5, c3=12.0, c4=0.25)
GAP_FREE = GapFreeModel(**PLAYS, q1=0.3, q2=0.02, c=-40.0)
GPI = GpiModel(p=PLAYS["p"], r=RADII, a_R=1.0, b_R=-7.2, a_L=1.0, b_L=-6.6, c=-60.0, v_low=3.5, v_high=8.5)
INVERSE = GpiInverse.of(GPI)
PREISACH = PreisachModel(
    grid=np.array([3.0, 4.5, 5.0, 6.5, 9.0]), mu=np.linspace(0.1, 1.0, 10), sign=-1.0, c=2.0, c1=0.5, c2=0.1
)
OBSERVER = ObserverParams(1.8e-3, 1e-6, 1e-4, 0.2, 4e-4, 3.5, 8.5, 0.15)


@pytest.mark.parametrize(
    ("params", "read"),
    [
        (EGPI.params, egpi_at),
        (INVERSE.params, gpi_inverse_at),
        (GAP_FREE.params, gap_free_at),
        (PREISACH.params, preisach_at),
    ],
    ids=["egpi", "gpi_inverse", "gap_free", "preisach"],
)
def test_parameters_are_read_back_as_they_were_packed(params, read):
    memory = pack(np.arange(3.0), 7.0, params, 8.0)
    assert_same(read(memory, 2), params)
    assert number_at(memory, 1) == 7.0
    assert memory[-1] == 8.0
    assert array_at(memory, 0).tolist() == [0.0, 1.0, 2.0]


def assert_same(found, expected):
    assert type(found) is type(expected)
    for name in expected._fields:
        value, wanted = getattr(found, name), getattr(expected, name)
        if isinstance(wanted, tuple):
            assert_same(value, wanted)
        else:
            assert np.shape(value) == np.shape(wanted), name
            np.testing.assert_array_equal(value, wanted, err_msg=name)


def test_a_part_is_a_view_and_the_packed_values_are_copies():
    state = np.zeros(4)
    memory = pack(1.0, state)
    array_at(memory, 1)[2] = 5.0
    assert array_at(memory, 1).tolist() == [0.0, 0.0, 5.0, 0.0]
    assert state.tolist() == [0.0] * 4


def test_the_composite_in_a_memory_is_the_composite():
    states = INVERSE.initial_state(3.7), EGPI.initial_state(3.7)
    memory = pack(*states, 3.6, 8.4, INVERSE.params, EGPI.params)
    for ohm in (*resistances(), np.nan, np.inf):
        separate = composite_step(*states, ohm, 3.6, 8.4, INVERSE.params, EGPI.params)
        assert packed_composite_step(memory, ohm) == separate


def test_the_gap_free_composite_in_a_memory_is_the_gap_free_composite():
    states = GAP_FREE.initial_state(3.7), EGPI.initial_state(3.7)
    memory = pack(*states, 3.6, 8.4, EGPI.params, GAP_FREE.params)
    for ohm in (*np.exp(-GAP_FREE.simulate(currents())), -1.0, np.nan):
        separate = gap_free_composite_step(*states, ohm, 3.6, 8.4, GAP_FREE.params, EGPI.params)
        assert packed_gap_free_composite_step(memory, ohm) == separate


def test_the_observer_in_a_memory_is_the_observer():
    x = filter_start(OBSERVER, 13.0)
    stacks = [PREISACH.initial_state(3.7) for _ in range(3)]
    memory = pack(x, *stacks, OBSERVER, PREISACH.params, PREISACH.params)
    for current, ohm in zip(currents(), (*resistances()[:-1], np.nan), strict=True):
        separate = observer_step(
            x, *stacks, current, ohm, 1e-3, OBSERVER, PREISACH.params, PREISACH.params
        )  # fmt: skip
        assert packed_observer_step(memory, current, ohm, 1e-3) == separate


def currents():
    """[mA], with minor loops and noise."""
    draw = np.random.default_rng(7)
    return np.clip(6.0 + 2.2 * np.sin(np.arange(400) / 9.0) + draw.normal(0.0, 0.2, 400), 3.6, 8.4)


def resistances():
    """[ohm] that the GPI gives, some beyond what it can, where the inverse saturates."""
    ohm = -1e3 * GPI.simulate(currents())
    ohm[100], ohm[200] = 1.0, 3e5
    return ohm
