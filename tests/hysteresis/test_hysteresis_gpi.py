"""Claims on envelopes, the GPI and the extended GPI model."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hysteresis_cases import HIGH, LOW, claim, egpi_models, gpi_models, histories, lines, radii, scale
from hysteresis_oracles import classical_play, generalised_play, gpi

from rtctl.hysteresis.egpi import EgpiModel, egpi_step
from rtctl.hysteresis.envelopes import Line, cooling_line, crossing_depth
from rtctl.hysteresis.gpi import GpiModel, gpi_step


def envelopes_of(model):
    return (
        lambda x: math.tanh(model.a_R * x + model.b_R),
        lambda x: math.tanh(model.a_L * x + model.b_L),
    )


@claim
@given(gpi_models(), histories())
def test_gpi_is_the_papers_equations_three_to_six(model, v):
    start = model.initial_state(v[0])
    expected = gpi(v, start, model.p, model.r, *envelopes_of(model), model.c)
    np.testing.assert_allclose(model.simulate(v), expected, rtol=0.0, atol=1e-12 * scale(model))


@claim
@given(gpi_models(), histories())
def test_gpi_is_a_classical_pi_of_one_generalised_play_of_radius_zero(model, v):
    u = generalised_play(v, model.initial_state(v[0])[0], *envelopes_of(model), 0.0)
    plays = [classical_play(u, w, r) for w, r in zip(model.initial_state(v[0]), model.r, strict=True)]
    np.testing.assert_allclose(
        model.simulate(v), model.c + model.p @ np.array(plays), atol=1e-12 * scale(model)
    )


@claim
@given(gpi_models(), histories(), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_egpi_with_common_envelopes_is_gpi_plus_its_polynomial(model, v, c2, c3, c4):
    each = {name: np.full(model.p.size, getattr(model, name)) for name in ("a_R", "b_R", "a_L", "b_L")}
    extended = EgpiModel(p=model.p, r=model.r, **each, c2=c2, c3=c3, c4=c4, v_low=LOW, v_high=HIGH)
    expected = model.simulate(v) - model.c + c3 + c2 * v + c4 * v**2
    np.testing.assert_allclose(extended.simulate(v), expected, atol=1e-12 * scale(extended))


@claim
@given(egpi_models(), histories())
def test_egpi_is_each_play_between_its_own_envelopes(model, v):
    y = model.c3 + model.c2 * v + model.c4 * v**2
    for j, w in enumerate(model.initial_state(v[0])):

        def gamma_R(x, j=j):
            return math.tanh(model.a_R[j] * x + model.b_R[j])

        def gamma_L(x, j=j):
            return math.tanh(model.a_L[j] * x + model.b_L[j])

        y = y + model.p[j] * generalised_play(v, w, gamma_R, gamma_L, model.r[j])
    np.testing.assert_allclose(model.simulate(v), y, atol=1e-12 * scale(model))


@claim
@given(gpi_models(), egpi_models())
def test_a_step_on_nan_answers_nan_and_moves_nothing(common, extended):
    for step, model in ((gpi_step, common), (egpi_step, extended)):
        w = model.initial_state(6.0)
        kept = w.copy()
        assert math.isnan(step(w, math.nan, model.params))
        np.testing.assert_array_equal(w, kept)


@claim
@given(lines())
def test_gaps_that_are_not_negative_keep_the_order_of_every_play(pair):
    heating, cooling = pair
    r = np.array([0.0, 0.3])
    assert (crossing_depth(heating, cooling, r, (LOW, HIGH)) <= 1e-9).all()
    gaps = ((cooling.a - heating.a) * v + (cooling.b - heating.b) for v in (LOW, HIGH))
    low, high = (max(gap, 0.0) for gap in gaps)  # -0.0 by rounding
    np.testing.assert_allclose(cooling_line(heating, (low, high), (LOW, HIGH)), cooling, atol=1e-9)


def test_a_negative_gap_is_refused():
    with pytest.raises(ValueError, match="must be >= 0 at both ends"):
        cooling_line(Line(1.0, -7.0), (0.5, -0.1), (LOW, HIGH))


ORDERED = {"p": [1.0, 0.5], "r": [0.0, 0.2], "a_R": 1.0, "b_R": -7.2, "a_L": 1.0, "b_L": -6.6, "c": 0.0}


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"b_L": -7.3}, "play 0: gamma_R - r exceeds gamma_L"),
        ({"a_L": 0.8, "b_L": -5.6}, "play 0: gamma_R - r exceeds gamma_L"),  # cross at 8 mA
        ({"a_R": -1.0}, "a_R must be > 0, got -1: model the negative"),
        ({"r": [0.0, -0.1]}, "radii r must be >= 0"),
        ({"p": [1.0]}, r"p must have shape \(2,\), got \(1,\)"),
        ({"c": math.inf}, "c must be a finite number, got inf"),
        ({"v_low": 9.0}, "v_low = 9 must be below v_high = 8.5"),
    ],
)
def test_a_model_that_would_break_the_clamp_is_refused(change, complaint):
    GpiModel(**ORDERED, v_low=LOW, v_high=HIGH)
    with pytest.raises(ValueError, match=complaint):
        GpiModel(**{**ORDERED, "v_low": LOW, "v_high": HIGH, **change})


def test_a_radius_that_bridges_the_crossing_keeps_the_order():
    """gamma_R exceeds gamma_L by at most 2 r: the clamp still has its lower edge below its upper one."""
    crossing = {**ORDERED, "b_L": -7.3, "p": [1.0], "r": [0.06]}
    assert GpiModel(**crossing, v_low=LOW, v_high=HIGH).p.size == 1


@claim
@given(st.integers(1, 6).flatmap(radii), st.floats(LOW, HIGH))
def test_each_play_starts_where_full_cooling_and_a_rise_leave_it(r, v0):
    model = GpiModel(**{**ORDERED, "p": np.ones(r.size), "r": r}, v_low=LOW, v_high=HIGH)
    expected = np.maximum(r - 1.0, math.tanh(model.a_R * v0 + model.b_R) - r)
    np.testing.assert_allclose(model.initial_state(v0), expected, atol=1e-15)
