"""Feedforward through the identified inverse: on its own model it reaches each setpoint one period later."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.controllers.feedforward import InverseFeedforward
from rtctl.identification.vo2.heating import simulate_heating
from rtctl.models.span import Span
from rtctl.models.working_range import working_range


@pytest.fixture(scope="module")
def model(identified):
    return identified("vo2_a").model


def deflection_of(model, level, commands, period_s=1e-3):
    """The model's own deflection at the end of each command, from rest at `level` after a full cooling."""
    v = simulate_heating(np.concatenate(([level], commands, [0.0])), period_s, model.time_constant_s)[2:]
    return model.deflection_preisach.simulate(np.concatenate(([0.0, level], v)))[2:]


def test_on_its_own_model_the_deflection_is_at_the_setpoint_one_period_later(model):
    working = working_range(model.deflection_preisach, model.current)
    low, high = working.deflection
    time_s = 1e-3 * np.arange(600)
    setpoints = 0.5 * (low + high) - 0.35 * (high - low) * np.cos(2.0 * np.pi * 2.0 * time_s)
    feedforward = InverseFeedforward(model, model.current)
    assert feedforward.start(working.current.low) == working.current.low
    commands = np.array([feedforward.step(setpoint, 1e-3) for setpoint in setpoints])
    assert (commands >= model.current.low).all()
    assert (commands <= model.current.high).all()
    error = np.abs(deflection_of(model, working.current.low, commands) - setpoints)[20:]
    assert error.mean() < 0.002 * model.deflection.width
    assert np.quantile(error, 0.9) < 0.005 * model.deflection.width


def test_a_constant_setpoint_that_is_reached_holds_the_current(model):
    feedforward = InverseFeedforward(model, model.current)
    feedforward.start(6.0)
    commands = [feedforward.step(30.0, 1e-3) for _ in range(60)]
    assert np.ptp(commands[-20:]) < 1e-3


def test_a_start_forgets_the_old_run(model):
    feedforward, fresh = InverseFeedforward(model, model.current), InverseFeedforward(model, model.current)
    feedforward.start(6.0)
    for setpoint in (50.0, 10.0, 40.0):
        feedforward.step(setpoint, 1e-3)
    feedforward.start(5.0)
    fresh.start(5.0)
    assert [feedforward.step(x, 1e-3) for x in (20.0, 30.0)] == [fresh.step(x, 1e-3) for x in (20.0, 30.0)]


def test_commands_stay_within_the_current_that_is_allowed(model):
    allowed = Span(6.0, 7.2)
    feedforward = InverseFeedforward(model, allowed)
    feedforward.start(6.0)
    commands = [feedforward.step(setpoint, 1e-3) for setpoint in (55.0, 55.0, 2.0, 2.0, 55.0)]
    assert min(commands) >= allowed.low
    assert max(commands) <= allowed.high
