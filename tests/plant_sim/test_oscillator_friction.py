"""Dry friction inside a step: exact under constant forces, held to the last bit, of order two and more at its turns."""

from __future__ import annotations

import math

import numpy as np
import pytest
from duffing_cases import PERIOD_S, STIFFNESS, FloatArray, lane, multisine, simulation, stick_slip, stimulus

from plant_sim.oscillator.integration.friction import from_rest, through_turn

LEVEL = 60.0


def predicted(samples: FloatArray, steps_per_period: float, **nominal: float) -> FloatArray:
    bound = simulation("friction.coulomb", **nominal)
    values = lane(bound, {"friction.coulomb.level": LEVEL})
    outputs = bound.predict(stimulus(samples), values, steps_per_period=steps_per_period).outputs
    return outputs["displacement"][0]


@pytest.mark.parametrize(("other", "v1"), [(-90.0, 0.4), (-20.0, 0.4), (90.0, -0.4)])
def test_a_turn_under_a_constant_force_is_exact(other: float, v1: float) -> None:
    h, z1 = 0.01, 0.3
    held = math.copysign(LEVEL, v1)
    a1 = other - held
    z, v = through_turn.py_func(z1, v1, a1, z1 + h * v1 + 0.5 * h * h * a1, v1 + h * a1, held, h)
    turn = -v1 / a1
    at_turn = z1 + 0.5 * v1 * turn
    after = other + held if abs(other) > LEVEL else 0.0
    assert v == pytest.approx(after * (h - turn), rel=1e-12)
    assert z == pytest.approx(at_turn + 0.5 * after * (h - turn) ** 2, rel=1e-12)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_motion_breaks_away_where_a_growing_force_exceeds_the_level(sign: float) -> None:
    h, z1, held, slope = 0.01, 0.3, sign * 50.0, sign * 4000.0
    z, v = from_rest.py_func(z1, slope * h, held, h, LEVEL)
    since = h - (LEVEL - abs(held)) / abs(slope)
    assert v == pytest.approx(0.5 * slope * since**2, rel=1e-12)
    assert z == pytest.approx(z1 + slope * since**3 / 6.0, rel=1e-12)


def test_what_is_held_does_not_creep() -> None:
    samples = np.full(2000, 0.15)  # 45 mm/s^2 of 60
    bound = simulation("friction.coulomb")
    start = np.array([[1e-3, 0.0]])  # 9 mm/s^2 back
    values = lane(bound, {"friction.coulomb.level": LEVEL})
    held = bound.predict(stimulus(samples), values, start).outputs["displacement"][0]
    assert set(held.tolist()) == {1e-3}


def test_the_error_at_the_default_step_is_a_millionth_and_falls_with_more_than_the_square() -> None:
    samples = multisine()
    exact = stick_slip(samples, "linear", LEVEL)[:, 0]
    steps = np.array([64.0, 128.0, 256.0, 512.0])
    errors = [math.sqrt(np.mean((predicted(samples, s) - exact) ** 2)) / np.std(exact) for s in steps]
    assert errors[2] < 2e-5
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] < -2.0


def test_free_decay_loses_the_same_amplitude_every_half_period() -> None:
    w = math.sqrt(STIFFNESS)
    loss = 2.0 * LEVEL / w**2
    bound = simulation("friction.coulomb", damping=0.0, stiffness_cubic=0.0)
    z_0 = 9.7 * loss
    count = round(15 * 2.0 * math.pi / w / PERIOD_S)
    values = lane(bound, {"friction.coulomb.level": LEVEL})
    z = bound.predict(stimulus(np.zeros(count)), values, np.array([[z_0, 0.0]])).outputs["displacement"][0]
    t = PERIOD_S * np.arange(count)
    half = np.minimum(np.floor(t * w / math.pi), 10.0)
    swing = (z_0 - (half + 0.5) * loss) * np.cos(w * t)
    moving = half < 10.0  # after ten half periods 0.3 of a loss is left of 0.5 that friction holds
    expected = np.where(moving, swing + (-1.0) ** half * 0.5 * loss, z_0 - 10.0 * loss)
    assert np.abs(z - expected).max() < 1e-6 * z_0
