"""The discrete PI: its difference equation, its start, its limits, its deadband."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.controllers.pi import NoFeedforward, PiController, PiGains, beyond_deadband, pi_step
from rtctl.controllers.playback import PlaybackController
from rtctl.estimators.extended_observer import SwingingEstimate
from rtctl.interfaces import Estimate

claim = settings(deadline=None, max_examples=60, derandomize=True)
GAINS = PiGains(kp=0.02, ki=8.0)
PERIOD_S = 1e-3
errors = st.lists(st.floats(-60.0, 60.0), min_size=1, max_size=40)


def estimate(value):
    return Estimate(value, math.nan, 0.1, 0)


class Lead:
    """A feedforward that asks for a tenth of what is to come."""

    preview_s = 0.0

    def start(self, level):
        self.assumed = level
        return level

    def step(self, upcoming, elapsed_s):
        return 0.1 * upcoming


def started(level=6.0, setpoint=30.0, value=25.0, *, feedforward=None, deadband=0.0):
    pi = PiController(GAINS, feedforward or NoFeedforward(), deadband=deadband)
    pi.start([level], setpoint, estimate(value))
    return pi


@claim
@given(errors)
def test_the_command_is_the_closed_form_sum(sequence):
    pi = started(level=6.0, setpoint=0.0, value=0.0)
    for k, error in enumerate(sequence):
        action = pi.step(error, error, estimate(0.0), PERIOD_S)
        pi.applied(action.levels)
        expected = 6.0 + GAINS.kp * error + GAINS.ki * PERIOD_S * math.fsum(sequence[: k + 1])
        assert action.levels == pytest.approx((expected,), abs=1e-9)
        assert action.levels[0] == sum(action.terms)


@claim
@given(errors)
def test_a_swing_of_the_structure_is_not_answered(sequence):
    still, swinging = started(), started()
    for swing in sequence:
        here, there = estimate(24.0), SwingingEstimate(24.0 + swing, math.nan, 0.1, 0)
        there.swing = swing
        expected = still.step(30.0, 30.0, here, PERIOD_S).levels
        assert swinging.step(30.0, 30.0, there, PERIOD_S).levels == pytest.approx(expected, abs=1e-9)


@claim
@given(errors)
def test_python_controls_transfer_function_is_the_same_controller(sequence):
    transfer = control.tf([GAINS.kp + GAINS.ki * PERIOD_S, -GAINS.kp], [1.0, -1.0], PERIOD_S)
    pi = started(level=0.0, setpoint=0.0, value=0.0)
    found = [pi.step(error, error, estimate(0.0), PERIOD_S).levels[0] for error in sequence]
    time_s = PERIOD_S * np.arange(len(sequence) + 1)
    _, expected = control.forced_response(transfer, time_s, [*sequence, 0.0])
    np.testing.assert_allclose(found, expected[:-1], atol=1e-9)


@claim
@given(
    level=st.floats(3.0, 9.0),
    setpoint=st.floats(0.0, 60.0),
    value=st.floats(0.0, 60.0),
    band=st.floats(0.0, 1.0),
)
def test_the_start_is_bumpless_whatever_the_first_error(level, setpoint, value, band):
    for feedforward in (NoFeedforward(), Lead()):
        pi = PiController(GAINS, feedforward, deadband=band)
        pi.start([level], setpoint, estimate(value))
        # what the feedforward assumed for this level is what it goes on with
        steady = level if isinstance(feedforward, Lead) else 0.0
        action = pi.step(setpoint, 10.0 * steady, estimate(value), 0.0)
        assert action.levels[0] == pytest.approx(level, abs=1e-9)


def test_a_new_start_forgets_the_old_run():
    pi = started()
    for _ in range(50):
        pi.applied(pi.step(60.0, 60.0, estimate(0.0), PERIOD_S).levels)
    pi.start([6.0], 30.0, estimate(25.0))
    assert pi.step(30.0, 30.0, estimate(25.0), PERIOD_S) == started().step(
        30.0, 30.0, estimate(25.0), PERIOD_S
    )


@claim
@given(
    windup=st.floats(1.0, 60.0), samples=st.integers(1, 500), back=st.floats(0.01, 60.0), high=st.floats(6.0, 9.0)
)  # fmt: skip
def test_saturation_ends_one_step_after_the_error_changes_sign(windup, samples, back, high):
    pi = started(level=6.0, setpoint=0.0, value=0.0)
    for _ in range(samples):
        asked = pi.step(windup, windup, estimate(0.0), PERIOD_S).levels[0]
        pi.applied([min(max(asked, 3.7), high)])
    held = min(max(asked, 3.7), high)
    asked = pi.step(-back, -back, estimate(0.0), PERIOD_S).levels[0]
    # the step down of the proportional term and one integration below the limit: nothing is left to unwind
    assert asked == pytest.approx(held - GAINS.kp * (windup + back) - GAINS.ki * PERIOD_S * back, abs=1e-9)
    assert asked < high


@claim
@given(errors)
def test_the_integral_never_leaves_the_reach_of_the_limits(sequence):
    pi = started(level=6.0, setpoint=0.0, value=0.0)
    for error in sequence:
        for _ in range(30):
            action = pi.step(error, error, estimate(0.0), PERIOD_S)
            allowed = min(max(action.levels[0], 3.7), 8.5)
            pi.applied([allowed])
            assert pi._integral + action.terms.proportional + action.terms.feedforward == pytest.approx(
                allowed, abs=1e-9
            )


def test_an_allowed_command_leaves_the_integral_alone():
    pi = started()
    action = pi.step(30.0, 30.0, estimate(25.0), PERIOD_S)
    pi.applied(action.levels)
    assert pi._integral == action.terms.integral


@claim
@given(error=st.floats(-10.0, 10.0), band=st.floats(0.0, 5.0), nudge=st.floats(1e-9, 1e-3))
def test_the_deadband_is_continuous_odd_and_lets_the_rest_through(error, band, nudge):
    found = beyond_deadband(error, band)
    assert beyond_deadband(-error, band) == -found
    assert abs(found) == max(abs(error) - band, 0.0)
    assert abs(beyond_deadband(error + nudge, band) - found) <= nudge * (1.0 + 1e-6) + 1e-12


def test_within_the_deadband_the_command_stands():
    pi = started(setpoint=30.0, value=30.0, deadband=0.5)
    commands = []
    for value in (30.4, 29.6, 30.1, 29.51):
        action = pi.step(30.0, 30.0, estimate(value), PERIOD_S)
        pi.applied(action.levels)
        commands.append(action.levels[0])
    assert commands == [6.0] * 4
    assert pi.step(30.0, 30.0, estimate(29.0), PERIOD_S).levels[0] > 6.0


def test_no_deadband_lets_everything_through():
    assert (beyond_deadband(0.3, 0.0), beyond_deadband(-0.3, 0.0), beyond_deadband(0.0, 0.0)) == (
        0.3,
        -0.3,
        0.0,
    )


def test_one_step_is_the_equation():
    assert pi_step(5.0, 2.0, 0.5, 0.1, 3.0, 0.0) == pytest.approx((2.0, 0.2, 8.0))


@pytest.mark.parametrize(("kp", "ki"), [(-1e-9, 1.0), (0.1, 0.0), (0.1, -1.0), (math.nan, 1.0), (0.1, math.nan),
                                        (math.inf, 1.0), (0.1, math.inf)])  # fmt: skip
def test_gains_that_are_none_are_refused_with_their_units(kp, ki):
    with pytest.raises(ValueError, match=r"kp >= 0 mA/um and ki > 0 mA/\(um s\)"):
        PiGains(kp=kp, ki=ki)
    assert PiGains(kp=0.0, ki=1.0).kp == 0.0


def test_feedforward_aims_at_the_setpoint_to_come():
    pi = started(feedforward=Lead())
    action = pi.step(30.0, 44.0, estimate(25.0), PERIOD_S)
    assert action.terms.feedforward == pytest.approx(4.4)
    assert action.levels[0] == sum(action.terms)


def test_playback_commands_the_upcoming_setpoint():
    playback = PlaybackController()
    playback.start([4.0], 4.0, estimate(math.nan))
    action = playback.step(4.0, 5.5, estimate(math.nan), PERIOD_S)
    playback.applied([5.0])
    assert action == ((5.5,), (0.0, 0.0, 5.5))
