"""Claims on classical plays and stops."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hysteresis_cases import claim, histories
from hysteresis_oracles import classical_play, classical_stop

from rtctl.hysteresis.play import classical_plays, run_play

radius = st.floats(0.0, 3.0)


@claim
@given(histories(), radius, st.floats(-1.0, 1.0))
def test_a_clamp_is_the_play_with_its_direction_test(u, r, start):
    w = u[0] + r * start
    np.testing.assert_array_equal(run_play(w, u, r), classical_play(u, w, r))


@claim
@given(histories(), radius, radius)
def test_plays_compose_by_adding_radii(u, a, b):
    composed = run_play(u[0], run_play(u[0], u, b), a)
    np.testing.assert_allclose(composed, run_play(u[0], u, a + b), rtol=0.0, atol=1e-13)


@claim
@given(histories(), radius, st.floats(-1.0, 1.0))
def test_play_plus_stop_is_the_identity(u, r, start):
    s = r * start
    np.testing.assert_allclose(run_play(u[0] - s, u, r) + classical_stop(u, s, r), u, rtol=0.0, atol=1e-12)


@claim
@given(histories(), radius, st.data())
def test_a_larger_input_gives_no_smaller_output(u, r, data):
    more = np.array(data.draw(st.lists(st.floats(0.0, 2.0), min_size=u.size, max_size=u.size)))
    assert (run_play(u[0] + more[0], u + more, r) >= run_play(u[0], u, r)).all()


@claim
@given(histories(), st.lists(radius, min_size=1, max_size=5))
def test_a_bank_is_its_plays_side_by_side(u, radii):
    r = np.array(radii)
    bank = np.full(r.size, u[0])
    for x in u:
        classical_plays(bank, x, r)
    np.testing.assert_array_equal(bank, [run_play(u[0], u, each)[-1] for each in radii])
