"""The thermal observer: by reduction, against a textbook filter, and where the resistance must move it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from vo2_cases import DEVICES, run_over

from rtctl.estimators import ESTIMATORS
from rtctl.estimators.observer import (
    DISAGREEMENT,
    HEAT_START_MA2,
    ObserverParams,
    believed,
    condition_on,
    predict,
)
from rtctl.identification.vo2.heating import simulate_heating
from rtctl.interfaces import EstimateStatus

claim = settings(deadline=None, max_examples=60, derandomize=True)


@pytest.mark.parametrize("name", DEVICES)
def test_deaf_to_the_resistance_it_is_the_heating_and_the_preisach_model(identified, name):
    device = identified(name)
    model, observer = device.model, ESTIMATORS["observer"](device.model)
    observer._params = observer._params._replace(reading_variance=math.inf)
    run = run_over(observer, device.unseen, device.rest_mA)
    applied = np.concatenate(([device.rest_mA], device.unseen.signals["current"][:-1]))
    v = simulate_heating(np.append(applied, 0.0), 1e-3, model.time_constant_s)[
        1:
    ]  # heat() answers before a sample's current
    np.testing.assert_allclose(run.surrogate, v, rtol=1e-9)
    expected = model.deflection_preisach.simulate(np.concatenate(([0.0], v)))[1:]
    np.testing.assert_allclose(run.value, expected, atol=1e-6 * model.deflection.width)


def textbook(x, P, current, elapsed, p, innovation_of, sensitivity):
    """One step of the filter of (b, m) with matrices: F = diag(1, r), Q, H = (sensitivity, 1)."""
    a = math.exp(-elapsed / p.time_constant_s)
    before = math.sqrt(x[0])
    s = x[0] * a + (current**2 + x[1]) * (1.0 - a)
    r = math.exp(-abs(math.sqrt(s) - before) / p.error_length)
    F = np.diag([1.0, r])
    state = F @ x[1:]
    P = F @ P @ F.T + np.diag([p.heat_walk * elapsed, (1.0 - r * r) * p.model_variance])
    H = np.array([sensitivity, 1.0])
    innovation = innovation_of - H @ [0.0, state[1]]
    believed_variance = H @ P @ H + p.reading_variance
    S = max(
        believed_variance, (innovation / DISAGREEMENT) ** 2
    )  # of a reading farther off: what puts it there
    K = P @ H / S
    return (
        np.concatenate(([s], state + K * innovation)),
        P - np.outer(K, H @ P),
        abs(innovation) / math.sqrt(believed_variance),
    )


@claim
@given(
    current=st.floats(3.0, 9.0), b=st.floats(-2.0, 2.0), m=st.floats(-0.1, 0.1),
    reading=st.floats(-0.3, 0.3), sensitivity=st.floats(-0.05, 0.3), elapsed=st.floats(0.0, 1e-2),
)  # fmt: skip
def test_a_step_of_the_filter_is_the_textbooks(current, b, m, reading, sensitivity, elapsed):
    p = ObserverParams(1.8e-3, 1e-6, 1e-4, 0.25, 4e-4, 3.7, 8.5, 0.0)
    P = np.array([[0.8, -0.002], [-0.002, 9e-5]])
    x = np.array([36.0, 36.1, b, m, P[0, 0], P[0, 1], P[1, 1]])
    expected, P, deviations = textbook(np.array([36.0, b, m]), P, current, elapsed, p, reading, sensitivity)
    v = predict(x, current, elapsed, p)
    found = condition_on(x, reading - x[3], sensitivity, p.reading_variance)
    assert v == pytest.approx(math.sqrt(expected[0]))
    np.testing.assert_allclose([x[0], x[2], x[3]], expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose([x[4], x[5], x[5], x[6]], P.ravel(), rtol=1e-6, atol=1e-14)
    assert found == pytest.approx(deviations)


def test_heat_that_the_models_error_can_feign_is_hardly_acted_on():
    for sign in (1.0, -1.0):
        assert abs(believed(sign * 0.05, 0.15)) <= 0.11 * 0.05
        assert believed(sign * 1.5, 0.15) == pytest.approx(sign * 1.5, rel=0.01)
    assert believed(0.0, 0.15) == 0.0
    assert believed(0.3, 0.0) == 0.3


def test_the_covariance_stays_positive_over_a_long_run(identified):
    device = identified("vo2_a")
    observer = ESTIMATORS["observer"](device.model)
    run = run_over(observer, device.unseen, device.rest_mA)
    assert (run.confidence >= device.model.deflection_error).all()
    fresh = ESTIMATORS["observer"](device.model).start([device.rest_mA], [1.29e5]).confidence
    assert run.confidence[-1] < fresh, "the unknown heat is known better at the end than at the start"


@pytest.mark.parametrize("wrong", [1, 10])
def test_wrong_readings_are_told_and_hardly_believed(identified, wrong):
    """One reading or ten in a row each half second, of an ordinary size: they move the estimate by less than noise."""
    device = identified("vo2_a")
    sound = run_over(ESTIMATORS["observer"](device.model), device.unseen, device.rest_mA)
    resistance = device.unseen.signals["resistance"].copy()
    draw = np.random.default_rng(3)
    struck = np.concatenate([np.arange(k, k + wrong) for k in range(300, len(resistance), 500)])
    struck = struck[struck < len(resistance)]
    resistance[struck] = np.exp(draw.uniform(*np.log([resistance.min(), resistance.max()]), len(struck)))
    spoilt = replace(device.unseen, signals={**device.unseen.signals, "resistance": resistance})
    run = run_over(ESTIMATORS["observer"](device.model), spoilt, device.rest_mA)
    far = np.abs(np.log(resistance / device.unseen.signals["resistance"]))[struck] > 0.5
    assert (run.status[struck][far] & EstimateStatus.DISAGREES).all()
    assert np.abs(run.value - sound.value).max() < 0.01 * device.model.deflection.width


def test_holding_still_teaches_nothing_however_often_the_resistance_is_read(identified):
    """A model's error stays while the device stays: a filter that took it for noise would drift after it."""
    device = identified("vo2_a")
    observer = ESTIMATORS["observer"](device.model)
    observer.start([device.rest_mA], [1.29e5])
    warm = observer.step([6.8], [1.29e5], 1.0)
    reading = 40e3
    early = [observer.step([6.8], [reading], 1e-3) for _ in range(20)][-1]
    late = [observer.step([6.8], [reading], 1e-3) for _ in range(3000)][-1]
    assert abs(late.value - early.value) < 0.02 * device.model.deflection.width
    assert late.confidence > 0.3 * early.confidence
    assert warm.confidence > 0.0


def test_a_current_beyond_the_identified_range_is_flagged(identified):
    device = identified("vo2_a")
    observer = ESTIMATORS["observer"](device.model)
    observer.start([device.rest_mA], [1.29e5])
    assert observer.step([10.0], [11e3], 0.1).status & EstimateStatus.OUT_OF_RANGE


def test_missing_readings_leave_the_heating_running(identified):
    """A NaN is no measurement, not a stop: the temperature goes on as the current says."""
    device = identified("vo2_a")
    observer, deaf = (ESTIMATORS["observer"](device.model) for _ in range(2))
    deaf._params = deaf._params._replace(reading_variance=math.inf)
    for estimator in (observer, deaf):
        estimator.start([device.rest_mA], [math.nan])
    for current in (5.0, 7.0, 7.4, 6.4):
        for _ in range(6):
            blind, open_loop = observer.step([current], [math.nan], 1e-3), deaf.step([current], [5e4], 1e-3)
            assert blind.value == pytest.approx(open_loop.value, abs=1e-9)
            assert blind.status & EstimateStatus.NOT_FINITE
    assert blind.confidence > device.model.deflection_error
    assert math.isfinite(blind.confidence)


def test_the_unknown_heat_is_found(identified):
    """Readings made from the observer's own models at a known extra heat bring b to it."""
    model = identified("vo2_a").model
    extra, draw = 0.8 * HEAT_START_MA2, np.random.default_rng(4)
    current = np.repeat(draw.uniform(5.5, 7.9, 300), 10)
    power = np.sqrt(current**2 + extra)
    v = simulate_heating(np.append(power, 0.0), 1e-3, model.time_constant_s)[1:]
    cold = np.concatenate(([0.0], v))
    resistance = np.exp(-model.resistance_preisach.simulate(cold)[1:])
    deflection = model.deflection_preisach.simulate(cold)[1:]
    observer = ESTIMATORS["observer"](model)
    observer.start([current[0]], [resistance[0]])
    errors = [
        observer.step([i], [r], 1e-3).value - d
        for i, r, d in zip(current, resistance, deflection, strict=True)
    ]
    assert np.abs(errors[1500:]).mean() < 0.005 * model.deflection.width
