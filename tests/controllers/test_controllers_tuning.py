"""PI gains from the model: margins against python-control, the analytic loop, and loops simulated to the brink."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from vo2_cases import SCENARIOS

from rtctl.border.errors import InputError
from rtctl.controllers.pi import NoFeedforward, PiController, PiGains
from rtctl.controllers.tuning import loop_transfer, margins, tune
from rtctl.interfaces import Estimate
from rtctl.models.working_range import working_range
from rtctl.plants.vo2.control import build_controller
from rtctl.scenario.schema import load_scenario

claim = settings(deadline=None, max_examples=8, derandomize=True)  # twenty-five responses each
PLANT = {"plant_gain": 110.0, "time_constant_s": 1.8e-3, "period_s": 1e-3}
LEAST = {"least_gain_margin": 2.0, "least_phase_margin_deg": 60.0}
plants = st.fixed_dictionaries(
    {
        "plant_gain": st.floats(1.0, 500.0),
        "time_constant_s": st.floats(0.5e-3, 10e-3),
        "period_s": st.floats(0.2e-3, 2e-3),
        "delay": st.integers(0, 4),
    }
)


def closed_loop_errors(tuning, steps, *, plant_gain, time_constant_s, period_s, delay, gain_factor=1.0):
    """Deflection errors of the real controller on the linear plant, sample by sample."""
    decay = math.exp(-period_s / time_constant_s)
    pi = PiController(tuning.gains, NoFeedforward(), deadband=0.0)
    y, in_flight, errors = 0.0, [0.0] * delay, []
    pi.start([0.0], 0.0, Estimate(0.0, math.nan, 0.1, 0))
    for _ in range(steps):
        errors.append(1.0 - y)
        action = pi.step(1.0, 1.0, Estimate(y, math.nan, 0.1, 0), period_s)
        pi.applied(action.levels)
        in_flight.append(action.levels[0])
        y = decay * y + gain_factor * plant_gain * (1.0 - decay) * in_flight.pop(0)
    return np.array(errors)


@claim
@given(plants, st.floats(1.5, 4.0), st.floats(40.0, 75.0))
def test_tuning_keeps_both_margins_and_uses_one_of_them_up(plant, gain_margin, phase_margin):
    tuning = tune(**plant, least_gain_margin=gain_margin, least_phase_margin_deg=phase_margin)
    assert tuning.gain_margin >= gain_margin
    assert tuning.phase_margin_deg >= phase_margin
    used_up = min(tuning.gain_margin / gain_margin, tuning.phase_margin_deg / phase_margin)
    # by the bisection's last step, and the grid of the response: a part in two thousand of pi
    assert used_up == pytest.approx(1.0, abs=0.01)


@claim
@given(plants)
def test_margins_are_those_of_the_integrator_behind_its_delay(plant):
    """The zero cancels the pole: L(z) = g / (z - 1) z^-d, whose margins are in the textbook.

    |L| = g / (2 sin(w/2)), arg L = -(90 deg + (d + 1/2) w): phase margin 90 deg - (d + 1/2) w_c at
    w_c = 2 arcsin(g / 2), gain margin 2 sin(pi / (4 d + 2)) / g.
    """
    tuning = tune(**plant, **LEAST)
    decay = math.exp(-plant["period_s"] / plant["time_constant_s"])
    g, d = tuning.gains.ki * plant["plant_gain"] * plant["period_s"], plant["delay"]
    assert tuning.gains.kp == pytest.approx(g * decay / (plant["plant_gain"] * (1.0 - decay)))
    crossover = 2.0 * math.asin(0.5 * g)
    assert tuning.phase_margin_deg == pytest.approx(90.0 - math.degrees((d + 0.5) * crossover), abs=0.05)
    assert tuning.gain_margin == pytest.approx(2.0 * math.sin(math.pi / (4 * d + 2)) / g, rel=5e-3)
    assert tuning.crossover_hz == pytest.approx(crossover / (2.0 * math.pi * plant["period_s"]), rel=1e-3)


@pytest.mark.parametrize("delay", [1, 2, 3])
@pytest.mark.parametrize("zero", [0.4, 0.75])
def test_margins_are_python_controls_where_nothing_cancels(delay, zero):
    """A zero off the pole, and a phase crossing below half the sample rate: there `control.margin` is reliable."""
    ki = 4.0
    gains = PiGains(kp=ki * 1e-3 * zero / (1.0 - zero), ki=ki)
    found = margins(gains, **PLANT, delay=delay)
    gain_margin, phase_margin, _, crossover = control.margin(loop_transfer(gains, *PLANT.values(), delay))
    assert found.gain_margin == pytest.approx(gain_margin, rel=5e-3)
    assert found.phase_margin_deg == pytest.approx(phase_margin, abs=0.1)
    assert found.crossover_hz == pytest.approx(crossover / (2.0 * math.pi), rel=1e-3)


@claim
@given(plants)
def test_the_loop_is_stable_just_inside_the_gain_margin_and_unstable_just_outside(plant):
    tuning = tune(**plant, **LEAST)
    growth = {}
    for share in (0.99, 1.01):
        factor = share * tuning.gain_margin
        errors = np.abs(closed_loop_errors(tuning, 4000, **plant, gain_factor=factor))
        growth[share] = errors[-200:].max() / errors[200:400].max()
    assert growth[0.99] < 0.5
    assert growth[1.01] > 2.0


@claim
@given(plants)
def test_the_tuned_loop_settles_without_a_lasting_error(plant):
    tuning = tune(**plant, **LEAST)
    errors = closed_loop_errors(tuning, 600, **plant)
    assert abs(errors[-1]) < 1e-6
    assert errors.min() > -0.2, "a phase margin of 60 deg overshoots little"


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_the_transfer_function_is_the_simulated_loop(delay):
    gains = PiGains(kp=0.004, ki=3.0)
    loop = control.feedback(loop_transfer(gains, *PLANT.values(), delay), 1)
    _, response = control.step_response(loop, PLANT["period_s"] * np.arange(60))
    tuning = margins(gains, **PLANT, delay=delay)
    np.testing.assert_allclose(
        response, 1.0 - closed_loop_errors(tuning, 60, **PLANT, delay=delay), atol=1e-9
    )


def test_a_slower_wire_costs_speed_and_a_smaller_plant_gain_costs_none():
    crossovers = [tune(**PLANT, delay=delay, **LEAST).crossover_hz for delay in range(4)]
    assert crossovers == sorted(crossovers, reverse=True)
    assert crossovers[0] > 2.0 * crossovers[2]
    small = tune(**{**PLANT, "plant_gain": 11.0}, delay=1, **LEAST)
    assert small.crossover_hz == pytest.approx(crossovers[1])
    assert small.gains.ki == pytest.approx(10.0 * tune(**PLANT, delay=1, **LEAST).gains.ki)


@pytest.mark.parametrize("gain", [0.0, -3.0, math.nan, math.inf])
def test_a_slope_that_cannot_be_tuned_on_is_refused(gain):
    with pytest.raises(ValueError, match="slope must be > 0 um/mA and finite"):
        tune(**{**PLANT, "plant_gain": gain}, delay=1, **LEAST)


def test_margins_that_no_gain_keeps_are_seen_in_what_comes_back(identified):
    slowest = tune(**PLANT, delay=1, least_gain_margin=2.0, least_phase_margin_deg=90.0)
    assert 89.0 < slowest.phase_margin_deg < 90.0
    scenario = load_scenario(SCENARIOS / "steps.toml", ['controller.phase_margin="1.6 rad"'])[0]
    model = identified("vo2_a").model
    with pytest.raises(InputError, match=r"controller.phase_margin = 91.7 deg .* ask for less"):
        build_controller(scenario, model, working_range(model.deflection_preisach, model.current), 1)


def test_hand_set_gains_are_used_and_reported_with_their_margins(identified):
    model = identified("vo2_a").model
    working = working_range(model.deflection_preisach, model.current)
    scenario = load_scenario(
        SCENARIOS / "steps.toml", ['controller.kp="0.004 mA/um"', 'controller.ki="3 mA/(um*s)"']
    )[0]
    controller, tuning = build_controller(scenario, model, working, 1)
    assert controller.gains == tuning.gains == PiGains(kp=0.004, ki=3.0)
    expected = margins(
        tuning.gains,
        plant_gain=working.steepest_slope,
        time_constant_s=model.time_constant_s,
        period_s=1e-3,
        delay=1,
    )
    assert tuning == expected
    assert 1.0 < tuning.gain_margin < math.inf
    assert 0.0 < tuning.phase_margin_deg < 90.0


def test_an_unstable_hand_set_gain_says_so_by_its_margins():
    found = margins(PiGains(kp=1.0, ki=100.0), **PLANT, delay=1)
    assert found.gain_margin < 1.0
    assert found.phase_margin_deg < 0.0
    mild = margins(PiGains(kp=0.02, ki=20.0), **PLANT, delay=1)
    assert mild.gain_margin < 1.0 < 2.0 * mild.gain_margin
    assert mild.phase_margin_deg < 0.0
