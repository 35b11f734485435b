"""Play models by variable projection: known models given back, ordered envelopes, Kaufman's Jacobian."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.hysteresis.egpi import EgpiModel
from rtctl.hysteresis.envelopes import crossing_depth
from rtctl.hysteresis.gpi import GpiModel
from rtctl.identification.vo2 import play_fit
from rtctl.identification.vo2.play_fit import (
    PARAMETERS,
    EnvelopePairs,
    PlayProblem,
    compute_envelopes,
    compute_play_columns,
    fit_plays,
    spread_starts,
)

claim = settings(deadline=None, max_examples=60, derandomize=True)
LOW, HIGH = 3.7, 8.5


def damped_oscillation(cycles=8, step=0.05):
    turns = [LOW]
    for k in range(cycles):
        turns += [6.3 + (1.0 - k / cycles) * (HIGH - 6.3), 6.3 - (1.0 - k / cycles) * (6.3 - LOW)]
    legs = [
        np.linspace(a, b, max(2, round(abs(b - a) / step)))[1:]
        for a, b in zip(turns[:-1], turns[1:], strict=True)
    ]
    return np.concatenate(([0.0, LOW], *legs))


def problem_of(v, y, plays, *, common, linear=False, least=0.0):
    """The problem of `identify_vo2` for outputs y of v, v = 0 being resets."""
    columns = [np.ones_like(v), v] if linear else [np.ones_like(v)]
    return PlayProblem(
        v=v, y=y, scored=v > 0.0, radii=np.arange(plays) / plays, common=common, free=np.stack(columns, axis=1),
        nonnegative=np.empty((len(v), 0)), least_first_weight=least,
    )  # fmt: skip


def known_gpi():
    return GpiModel(
        p=np.array([40.0, 8.0, 12.0]), r=np.arange(3) / 3, a_R=1.6, b_R=-1.6 * 7.1, a_L=1.5, b_L=-1.5 * 6.4,
        c=-70.0, v_low=LOW, v_high=HIGH,
    )  # fmt: skip


def known_egpi():
    a_R, a_L = np.array([1.6, 2.5, 0.9]), np.array([1.5, 2.2, 0.9])
    return EgpiModel(
        p=np.array([10.0, 14.0, 6.0]), r=np.arange(3) / 3, a_R=a_R, b_R=-a_R * [6.7, 7.1, 7.6],
        a_L=a_L, b_L=-a_L * [6.2, 6.5, 7.0], c2=-3.0, c3=60.0, v_low=LOW, v_high=HIGH,
    )  # fmt: skip


def plays_of(v, radii, a_R, b_R, a_L, b_L):
    """Outputs (n, plays) of generalised plays that start on the cooling branch; equations (3), (4)."""
    still = np.zeros((2, PARAMETERS, len(radii)))
    arguments = play_fit._compute_arguments(v, EnvelopePairs(a_R, b_R, a_L, b_L))
    return compute_play_columns(v, np.ones(len(v), dtype=bool), radii, *arguments, still, still)[:, 0].T


def test_a_known_gpi_is_reproduced_from_noise_free_data_and_on_data_never_seen():
    v, model = damped_oscillation(), known_gpi()
    y = model.simulate(v)
    problem = problem_of(v, y, 3, common=True, least=0.02 * float(np.ptp(y)))
    fit = fit_plays(problem, spread_starts(problem, 6, seed=0), evaluations=100)
    assert np.abs(fit.residual).max() < 1e-3 * np.ptp(y)
    unseen = np.concatenate(([0.0], np.random.default_rng(3).uniform(LOW, HIGH, 500)))
    outputs = plays_of(unseen, problem.radii, *fit.envelopes)
    error = outputs @ fit.weights + fit.free[0] - model.simulate(unseen)
    assert np.abs(error[1:]).max() < 1e-3 * np.ptp(y)
    assert fit.weights[0] >= 0.02 * np.ptp(y), "the analytic inverse divides by it"


def test_a_known_egpi_is_reproduced_from_noise_free_data():
    v, model = damped_oscillation(), known_egpi()
    y = model.simulate(v)
    problem = problem_of(v, y, 3, common=False, linear=True)
    fit = fit_plays(problem, spread_starts(problem, 6, seed=0), evaluations=200)
    assert np.abs(fit.residual).max() < 1e-3 * np.ptp(y)


def test_the_same_seed_gives_the_same_fit_and_another_other_starts():
    v = damped_oscillation()
    problem = problem_of(v, known_egpi().simulate(v), 3, common=False, linear=True)
    first, again, other = (spread_starts(problem, 3, seed) for seed in (4, 4, 5))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first[1], other[1])
    np.testing.assert_array_equal(first[0], other[0], "the first start has no scatter")
    fits = [fit_plays(problem, first, evaluations=20) for _ in range(2)]
    for a, b in zip(fits[0], fits[1], strict=True):
        np.testing.assert_array_equal(a, b)


def test_starts_do_not_depend_on_the_order_of_the_records():
    first, second = damped_oscillation(), np.concatenate(([0.0], np.linspace(4.0, 6.5, 40)))
    starts = []
    for order in ((first, second), (second, first)):
        y = np.concatenate([known_egpi().simulate(part) for part in order])
        problem = problem_of(np.concatenate(order), y, 3, common=False, linear=True)
        starts.append(spread_starts(problem, 3, seed=4))
    np.testing.assert_allclose(starts[0], starts[1], rtol=1e-12)


def test_more_starts_never_end_worse():
    v = damped_oscillation(step=0.1)
    y = known_egpi().simulate(v) + np.random.default_rng(0).normal(0.0, 0.3, len(v))
    problem = problem_of(v, y, 2, common=False, linear=True)
    starts = spread_starts(problem, 6, seed=1)
    costs = [np.sum(fit_plays(problem, starts[:n], evaluations=60).residual ** 2) for n in (1, 6)]
    assert costs[1] <= costs[0] * (1.0 + 1e-6)


@pytest.mark.parametrize("common", [True, False])
def test_a_least_first_weight_is_added_once(common):
    v, model = damped_oscillation(step=0.1), known_gpi()
    y = model.simulate(v)
    problem = problem_of(v, y, 3, common=common, least=0.9 * float(np.ptp(y)))  # more than the data want
    fit = fit_plays(problem, spread_starts(problem, 1, seed=0), evaluations=5)
    outputs = plays_of(v, problem.radii, *fit.envelopes)
    np.testing.assert_allclose(fit.residual, (y - outputs @ fit.weights - fit.free[0])[v > 0.0], atol=1e-9)
    assert fit.weights[0] >= 0.9 * np.ptp(y)


def thetas(pairs=3):
    """theta anywhere within the bounds of the fit over LOW..HIGH."""
    low, high = play_fit._make_bounds(
        problem_of(np.array([0.0, LOW, HIGH]), np.zeros(3), pairs, common=False), pairs
    )
    return st.tuples(*(st.floats(a, b) for a, b in zip(low, high, strict=True))).map(np.array)


@claim
@given(theta=thetas())
def test_envelopes_rise_and_keep_their_order_wherever_the_fit_may_go(theta):
    envelopes = compute_envelopes(theta, 3)
    assert (envelopes.a_R > 0.0).all()
    assert (envelopes.a_L > 0.0).all()
    heating, cooling = (envelopes.a_R, envelopes.b_R), (envelopes.a_L, envelopes.b_L)
    depth = crossing_depth(heating, cooling, np.zeros(3), (LOW, HIGH))
    assert depth.max() <= 4e-8, "1 - tanh X = 2e-8 on either side is all that can cross"
    wide = crossing_depth(heating, cooling, np.zeros(3), (-100.0, 100.0))
    assert wide.max() <= 4e-8


@claim
@given(theta=thetas(pairs=2))
def test_the_parameters_are_the_centres_and_the_gap_of_the_branches(theta):
    envelopes = compute_envelopes(theta, 2)
    heating, cooling = -envelopes.b_R / envelopes.a_R, -envelopes.b_L / envelopes.a_L
    np.testing.assert_allclose(0.5 * (heating + cooling), theta[2::PARAMETERS], atol=1e-9)
    np.testing.assert_allclose(heating - cooling, theta[3::PARAMETERS], atol=1e-9)


def test_one_pair_is_the_envelope_of_every_play():
    one = compute_envelopes(np.array([-0.5, 0.3, 6.4, 0.7]), 4)
    assert all(np.array_equal(part, np.full(4, part[0])) for part in one)


def test_regressors_are_the_plays_of_the_hysteresis_package():
    v, model = damped_oscillation(), known_egpi()
    outputs = plays_of(v, model.r, model.a_R, model.b_R, model.a_L, model.b_L) @ model.p
    expected = model.simulate(v) - model.c3 - model.c2 * v
    heated = int(v.argmax())
    np.testing.assert_allclose(outputs[heated:], expected[heated:], atol=1e-12)
    # before, one has cooled to v = 0 and the other until the envelopes are -1: 1 + gamma_L(0) apart at most
    reach = float(model.p @ (1.0 + np.tanh(model.b_L)))
    assert np.abs(outputs - expected).max() <= reach * (1.0 + 1e-9)


@pytest.mark.parametrize("common", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_kaufmans_jacobian_is_exact_off_the_fitted_columns_and_its_gradient_everywhere(common, seed):
    """dr = -P dW p - (W+)' dW' r: Kaufman leaves out the second term, which lies in the span of the columns.

    So what of a finite difference lies off that span must agree, and so must the gradient J' r, as r is
    perpendicular to the span; the difference within it is what was left out.
    """
    draw = np.random.default_rng(seed)
    v = damped_oscillation(step=0.1)
    y = known_egpi().simulate(v) + draw.normal(0.0, 1.0, len(v))
    problem = problem_of(v, y, 3, common=common, linear=not common, least=2.0 if common else 0.0)
    theta = spread_starts(problem, 2, seed)[1]
    low, high = play_fit._make_bounds(problem, 1 if common else 3)
    theta = np.clip(theta, low + 0.05, high - 0.05)
    columns = play_fit._build_columns(problem, theta)
    inner, plays = play_fit._solve_inner(problem, columns), columns.plays
    jacobian = play_fit._compute_jacobian(problem, columns, inner)
    basis = np.linalg.qr(np.hstack((problem.free[problem.scored], plays[:, inner.nonnegative > 0.0])))[0]
    step, left_out = 1e-6, []
    for k in range(len(theta)):
        thetas = [theta + sign * step * np.eye(len(theta))[k] for sign in (1, -1)]
        moved = [play_fit._solve_inner(problem, play_fit._build_columns(problem, moved)) for moved in thetas]
        if any(((m.nonnegative > 0.0) != (inner.nonnegative > 0.0)).any() for m in moved):
            continue  # a weight becomes zero: there the residual has a kink
        difference = (moved[0].residual - moved[1].residual) / (2.0 * step)
        within = basis @ (basis.T @ difference)
        scale = np.linalg.norm(difference) + np.linalg.norm(jacobian[:, k]) + 1e-3
        assert np.linalg.norm(difference - within - jacobian[:, k]) < 2e-3 * scale
        gradient, expected = jacobian[:, k] @ inner.residual, difference @ inner.residual
        assert gradient == pytest.approx(expected, abs=2e-3 * scale * np.linalg.norm(inner.residual))
        left_out.append(np.linalg.norm(within))
    assert len(left_out) >= len(theta) // 2
    assert max(left_out) > 1e-3, "or the comparison says nothing about what Kaufman leaves out"


def test_a_parameter_moves_the_residual_through_its_own_play_alone():
    v = damped_oscillation(step=0.1)
    problem = problem_of(v, known_egpi().simulate(v), 3, common=False, linear=True)
    theta = spread_starts(problem, 1, 0)[0]
    base = plays_of(v, problem.radii, *compute_envelopes(theta, 3))
    for k in range(len(theta)):
        moved = plays_of(v, problem.radii, *compute_envelopes(theta + 0.01 * np.eye(len(theta))[k], 3))
        changed = np.flatnonzero(np.abs(moved - base).max(axis=0) > 1e-9)
        assert set(changed) <= {k // PARAMETERS}


@pytest.mark.parametrize("common", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_derivatives_of_the_plays_are_their_finite_differences(common, seed):
    v = damped_oscillation()
    problem = problem_of(v, known_egpi().simulate(v), 3, common=common)
    theta = spread_starts(problem, 2, seed)[1]
    derivatives = play_fit._build_columns(problem, theta).derivatives
    for k in range(len(theta)):
        step = 1e-6 * np.eye(len(theta))[k]
        ahead, behind = (play_fit._build_columns(problem, theta + sign * step).plays for sign in (1, -1))
        touched = slice(None) if common else slice(k // PARAMETERS, k // PARAMETERS + 1)
        found = derivatives[:, touched, k % PARAMETERS]
        expected = ((ahead - behind) / 2e-6)[:, touched]
        away = np.abs(found - expected) > 1e-6 * (1.0 + np.abs(expected).max())
        assert away.mean() < 0.01, "only where a play changes hands within the step"


@pytest.mark.parametrize("common", [True, False])
def test_compressed_columns_have_the_same_fit_and_the_same_normal_equations(common):
    v = damped_oscillation()
    y = known_egpi().simulate(v) + np.random.default_rng(2).normal(0.0, 1.0, len(v))
    problem = problem_of(v, y, 3, common=common, linear=not common, least=2.0)
    whole = play_fit._build_columns(problem, spread_starts(problem, 2, 1)[1])
    small = play_fit._compress(whole)
    assert len(small.y) == small.free.shape[1] + 3 + 1 + 3 * PARAMETERS < len(whole.y)
    fits = [play_fit._solve_inner(problem, columns) for columns in (whole, small)]
    np.testing.assert_allclose(fits[1].nonnegative, fits[0].nonnegative, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(fits[1].free, fits[0].free, rtol=1e-9)
    slopes = [play_fit._compute_jacobian(problem, c, f) for c, f in zip((whole, small), fits, strict=True)]
    residuals = [fit.residual for fit in fits]
    scale = np.linalg.norm(slopes[0]) * max(np.linalg.norm(slopes[0]), np.linalg.norm(residuals[0]))
    assert residuals[1] @ residuals[1] == pytest.approx(residuals[0] @ residuals[0], rel=1e-12)
    for left in (slopes, residuals):
        np.testing.assert_allclose(left[1].T @ slopes[1], left[0].T @ slopes[0], atol=1e-12 * scale)


def test_screening_leaves_samples_out_of_the_score_and_never_fewer_than_a_hundred():
    scored = np.ones(1000, dtype=bool)
    scored[::10] = False
    assert play_fit._thin_scored(4, scored).sum() == 225
    assert not play_fit._thin_scored(4, scored)[~scored].any()
    few = np.arange(300) < 150
    np.testing.assert_array_equal(play_fit._thin_scored(4, few), few)
