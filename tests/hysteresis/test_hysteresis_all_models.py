"""Claims that every model of hysteresis must meet: what rate-independent means, memory, hand-over, files."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hysteresis_cases import HIGH, LOW, RUN, any_models, claim, histories, levels, rising_models, scale

from rtctl.border.errors import InputError


def tolerance(model):
    return {"rtol": 0.0, "atol": 1e-12 * scale(model)}


@claim
@given(any_models, histories(max_size=15), st.integers(1, 7))
def test_resampling_the_path_changes_no_output(model, v, between):
    knots = np.arange(v.size)
    dense = np.interp(np.arange(between * (v.size - 1) + 1) / between, knots, v)
    dense[::between] = v
    np.testing.assert_allclose(model.simulate(dense)[::between], model.simulate(v), **tolerance(model))


@claim
@given(any_models, histories(), st.data())
def test_a_closed_excursion_within_the_last_turning_points_is_forgotten(model, v, data):
    lowest, highest = sorted(v[-2:])
    inside = st.lists(st.floats(lowest, highest), max_size=8).map(lambda x: np.array(x, dtype=float))
    excursion, after = data.draw(inside), data.draw(histories())
    plain = model.simulate(np.concatenate((v, after)))
    returned = model.simulate(np.concatenate((v, excursion, v[-2:], after)))
    np.testing.assert_allclose(returned[-after.size :], plain[-after.size :], **tolerance(model))


@claim
@given(any_models, histories(), levels, levels, histories())
def test_an_input_that_passes_older_turning_points_wipes_them_out(model, v, one, other, after):
    """Whatever happened inside the last, larger excursion leaves no trace once it is passed."""
    sweep = np.array([max(one, other, *v), min(one, other, *v)])
    wiped = model.simulate(np.concatenate((v, sweep, after)), model.initial_state(LOW))
    plain = model.simulate(np.concatenate((sweep, after)), model.initial_state(LOW))
    np.testing.assert_allclose(wiped[-after.size :], plain[-after.size :], **tolerance(model))


@claim
@given(any_models, histories(), histories(), st.lists(st.floats(LOW, HIGH), min_size=2, max_size=6))
def test_loops_between_the_same_inputs_are_congruent(model, one, other, turns):
    lap = np.array([min(turns), *turns, max(turns), *turns, min(turns)])
    shapes = []
    for history in (one, other):
        y = model.simulate(np.concatenate((history, lap, lap)))[-lap.size :]
        shapes.append(y - y[0])
    np.testing.assert_allclose(shapes[0], shapes[1], **tolerance(model))


@claim
@given(rising_models, histories())
def test_the_output_of_a_rising_model_follows_the_direction_of_the_input(model, v):
    y = model.simulate(v)
    assert (np.diff(y) * np.sign(np.diff(v)) >= -1e-12 * scale(model)).all()


@claim
@given(any_models, histories(), st.data())
def test_a_run_in_two_parts_with_the_state_handed_over_is_one_run(model, v, data):
    cut = data.draw(st.integers(0, v.size))
    state = model.initial_state(v[0])
    run = RUN[type(model)]
    parts = np.concatenate((run(state, v[:cut], model.params), run(state, v[cut:], model.params)))
    np.testing.assert_array_equal(parts, model.simulate(v))


@claim
@given(any_models, histories())
def test_simulate_leaves_the_given_state_alone(model, v):
    state = model.initial_state(LOW)
    kept = state.copy()
    model.simulate(v, state)
    np.testing.assert_array_equal(state, kept)


@claim
@given(any_models, histories(), histories())
def test_the_initial_state_forgets_all_after_a_full_cooling(model, before, v):
    """Heating to where tanh is one and cooling to where it is minus one leaves `initial_state`."""
    deep = np.concatenate((before, [1e3, -1e3], v))
    state = model.initial_state(LOW)
    y = RUN[type(model)](state, deep, model.params)[-v.size :]
    np.testing.assert_allclose(y, model.simulate(v), **tolerance(model))


@claim
@given(any_models)
def test_a_table_in_toml_brings_back_every_bit(model):
    table = model.to_table()
    text = "\n".join(f"{key} = {value!r}".replace("'", '"') for key, value in table.items())
    again = type(model).from_table(tomllib.loads(text))
    assert again.to_table() == table
    np.testing.assert_array_equal(
        again.simulate(np.linspace(LOW, HIGH, 9)), model.simulate(np.linspace(LOW, HIGH, 9))
    )


@claim
@given(any_models, histories())
def test_an_input_that_is_not_a_number_is_refused_with_its_sample(model, v):
    v[1] = np.nan
    with pytest.raises(ValueError, match=r"nan at sample 1 of"):
        model.simulate(v)


@claim
@given(any_models)
def test_a_table_with_a_misspelt_key_names_the_right_one(model):
    table = model.to_table()
    table["cc"] = table.pop("c" if "c" in table else "c3")
    with pytest.raises(InputError, match=r'unknown key "cc"; did you mean "c'):
        type(model).from_table(table)


@claim
@given(any_models)
def test_a_table_of_another_kind_is_refused(model):
    with pytest.raises(InputError, match=r"kind is 'bouc_wen', .* is needed here"):
        type(model).from_table({**model.to_table(), "kind": "bouc_wen"})


@claim
@given(any_models)
def test_a_table_without_a_needed_key_says_which(model):
    key = "mu" if "mu" in model.to_table() else "r"
    table = {name: value for name, value in model.to_table().items() if name != key}
    with pytest.raises(InputError, match=f'key "{key}" is missing'):
        type(model).from_table(table)


@claim
@given(any_models)
def test_a_model_that_is_not_finite_is_refused(model):
    key = "mu" if "mu" in model.to_table() else "p"
    values = [float("nan")] * len(model.to_table()[key])
    with pytest.raises(InputError, match=f"{key} must be finite"):
        type(model).from_table({**model.to_table(), key: values})
