"""The paper's composite against its equations (7) to (15), line by line in plain Python."""

from __future__ import annotations

import math

import numpy as np
import pytest
from vo2_cases import DEVICES, run_over

from rtctl.estimators import ESTIMATORS
from rtctl.interfaces import EstimateStatus


def transcribed(model, resistance_ohm, v0):
    """Deflection [um] for each resistance, from a full cooling and up to v0.

    Two things that the paper does not say: u is held within +-(1 - 1e-6), where arctanh ends, and the surrogate
    between the halves within a tenth of the current range beyond it.
    """
    gpi, egpi = model.resistance_gpi, model.composite_egpi
    n, p, r = len(gpi.p), gpi.p, gpi.r
    P = [sum(p[: k + 1]) for k in range(n)]
    p_hat = [1.0 / p[0]] + [-p[k] / (P[k] * P[k - 1]) for k in range(1, n)]  # (10), (11) with its minus
    r_hat = [p[0] * r[j] + sum(p[k] * (r[j] - r[k]) for k in range(1, j)) for j in range(n)]  # (9)
    # memories of the plays (3), (4) after a cooling to saturation and a heating to v0
    heated = [math.tanh(gpi.a_R * v0 + gpi.b_R) - radius for radius in r]
    w = [max(radius - 1.0, edge) for radius, edge in zip(r, heated, strict=True)]
    z = [sum(p[: i + 1]) * w[i] + sum(p[j] * w[j] for j in range(i + 1, n)) for i in range(n)]
    W = [max(R - 1.0, math.tanh(a * v0 + b) - R) for R, a, b in zip(egpi.r, egpi.a_R, egpi.b_R, strict=True)]
    limit = sum(p[j] * (1.0 - 1e-6 - r[j]) for j in range(n))
    margin = 0.1 * model.current.width
    heating, v, last, answers = True, v0, sum(p[j] * w[j] for j in range(n)), []
    for resistance in resistance_ohm:
        y = min(max(-1e-3 * resistance - gpi.c, -limit), limit)  # (13): the model is of -R
        z = [min(max(z[j], y - r_hat[j]), y + r_hat[j]) for j in range(n)]
        if y != last:
            heating = y > last
            u = min(max(sum(p_hat[j] * z[j] for j in range(n)), -1.0 + 1e-6), 1.0 - 1e-6)  # (8)
            a, b = (gpi.a_R, gpi.b_R) if heating else (gpi.a_L, gpi.b_L)
            v = (math.atanh(u) - b) / a  # (7), (14)
        last = y
        V = min(max(v, model.current.low - margin), model.current.high + margin)
        value = egpi.c3 + egpi.c2 * V  # (15)
        for j in range(len(W)):
            W[j] = max(W[j], math.tanh(egpi.a_R[j] * V + egpi.b_R[j]) - egpi.r[j])
            W[j] = min(W[j], math.tanh(egpi.a_L[j] * V + egpi.b_L[j]) + egpi.r[j])
            value += egpi.p[j] * W[j]
        answers.append(value)
    return np.array(answers)


@pytest.mark.parametrize("name", DEVICES)
def test_the_composite_is_the_papers_equations(identified, name):
    device = identified(name)
    run = run_over(ESTIMATORS["composite"](device.model), device.unseen, device.rest_mA)
    resistance = device.unseen.signals["resistance"]
    expected = transcribed(device.model, resistance, device.rest_mA)
    np.testing.assert_allclose(run.value, expected, atol=1e-6 * device.model.deflection.width)


def test_two_equal_readings_hold_the_surrogate_and_say_so(identified):
    model = identified("vo2_a").model
    estimator = ESTIMATORS["composite"](model)
    estimator.start([3.68], [120e3])
    first = estimator.step([6.0], [60e3], 1e-3)
    second = estimator.step([6.0], [60e3], 1e-3)
    assert second.status & EstimateStatus.IN_GAP
    assert second.surrogate == first.surrogate


def test_the_standard_error_grows_where_arctanh_ends(identified):
    """Near saturation a reading's noise moves the surrogate far: the gain 1 / (a (1 - u^2)) says so."""
    model = identified("vo2_a").model
    estimator = ESTIMATORS["composite"](model)
    estimator.start([3.68], [120e3])
    middle = estimator.step([6.5], [60e3], 1e-3).confidence
    saturated = estimator.step([3.7], [1e6], 1e-3)
    assert saturated.status & EstimateStatus.SATURATED
    assert saturated.confidence > 10.0 * middle > 0.0


def test_the_current_has_no_say(identified):
    device = identified("vo2_a")
    estimators = [ESTIMATORS["composite"](device.model) for _ in range(2)]
    for estimator in estimators:
        estimator.start([3.68], [120e3])
    for reading in device.unseen.signals["resistance"][:300]:
        one, other = (e.step([x], [reading], 1e-3) for e, x in zip(estimators, (4.0, 8.0), strict=True))
        assert one == other
