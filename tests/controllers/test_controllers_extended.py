"""Tuning and feedforward of an extended model: against the plain ones, a dense simulation, and the model itself."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "simulations"))
from vo2_model_cases import PERIOD_S, predict, simulation, small_model, stimulus

from rtctl.controllers.extended_feedforward import ExtendedFeedforward
from rtctl.controllers.extended_tuning import extended_margins, tune_extended
from rtctl.controllers.feedforward import InverseFeedforward
from rtctl.controllers.linear_loop import LinearLoop
from rtctl.controllers.pi import PiGains
from rtctl.controllers.tuning import margins, tune
from rtctl.models.span import Span
from rtctl.plants.vo2.control import controlled
from rtctl.simulations.vo2 import extended_model
from rtctl.simulations.vo2.loop_dynamics import dynamics_of, loop_dynamics

H, TAU, GAIN = 1e-3, 1.8e-3, 40.0
ASKED = {"least_gain_margin": 2.0, "least_phase_margin_deg": 60.0}


def stepped(loop: LinearLoop, samples: int, substeps: int = 2000) -> np.ndarray:
    """Step response at the samples, by Euler steps of the states that the docstring's G has."""
    h = H / substeps
    late = round(loop.delay_s / h)
    fast = slow = seen = q = rate = 0.0
    w, found = 2.0 * math.pi * loop.frequency_hz, []
    for k in range(samples * substeps):
        u = 1.0 if k >= late else 0.0
        fast += h * (u - fast) / loop.time_constant_s
        slow += h * (u - slow) / loop.second_time_constant_s
        T = (1.0 - loop.share) * fast + loop.share * slow
        seen = T if loop.lag_s == 0.0 else seen + h * (T - seen) / loop.lag_s
        if loop.participation != 0.0:
            rate += h * (w * w * (seen - q) - 2.0 * loop.damping_ratio * w * rate)
            q += h * rate
        if k % substeps == substeps - 1:
            found.append((1.0 - loop.participation) * seen + loop.participation * q)
    return np.array(found)


@pytest.mark.parametrize(
    "loop",
    [
        LinearLoop(time_constant_s=TAU, delay_s=2.4e-3),
        LinearLoop(time_constant_s=TAU, share=0.3, second_time_constant_s=6e-3, lag_s=TAU),
        LinearLoop(
            time_constant_s=TAU, participation=0.8, frequency_hz=120.0, damping_ratio=0.1, delay_s=1e-3
        ),
    ],
    ids=["late", "slow", "swinging"],
)
def test_the_sampled_plant_is_the_continuous_one(loop):
    """Its frequency response, from the differences of a step response to where that has died out."""
    samples = 120
    response = stepped(loop, samples)
    impulse = np.diff(np.concatenate(([0.0], response)))
    angle = np.linspace(0.05, 3.0, 40)
    expected = np.exp(-1j * np.outer(angle, np.arange(1, samples + 1))) @ impulse
    assert np.abs(loop.response(angle, H) - expected).max() < 5e-3


def test_one_time_constant_has_the_margins_of_the_plain_tuning():
    gains = PiGains(kp=0.02, ki=8.0)
    plain = margins(gains, plant_gain=GAIN, time_constant_s=TAU, period_s=H, delay=1)
    found = extended_margins(gains, LinearLoop(time_constant_s=TAU), plant_gain=GAIN, period_s=H, delay=1)
    assert found.phase_margin_deg == pytest.approx(plain.phase_margin_deg, abs=0.1)
    assert found.gain_margin == pytest.approx(plain.gain_margin, rel=0.02)


@pytest.mark.parametrize(
    "loop",
    [
        LinearLoop(time_constant_s=TAU, delay_s=3e-3),
        LinearLoop(time_constant_s=TAU, share=0.35, second_time_constant_s=12e-3),
        LinearLoop(time_constant_s=TAU, lag_s=4e-3),
        LinearLoop(time_constant_s=TAU, participation=1.0, frequency_hz=150.0, damping_ratio=0.03),
    ],
    ids=["late", "slow", "lagging", "swinging"],
)
def test_the_margins_are_kept_where_the_plain_gains_lose_them(loop):
    plain = tune(plant_gain=GAIN, time_constant_s=TAU, period_s=H, delay=0, **ASKED)
    lost = extended_margins(plain.gains, loop, plant_gain=GAIN, period_s=H, delay=0)
    found = tune_extended(loop, plant_gain=GAIN, period_s=H, delay=0, **ASKED)
    assert found.gain_margin >= 2.0
    assert found.phase_margin_deg >= 60.0
    more_than_slowest = found.gains.ki * GAIN * H > 1e-3
    assert more_than_slowest
    slow = loop.share != 0.0  # a slow part costs no stability: the plain gains are merely no longer the best
    assert slow or lost.gain_margin < 2.0 or lost.phase_margin_deg < 60.0


@pytest.mark.parametrize(
    ("lag_s", "asked", "kept"),
    [(0.4e-3, 2.0, True), (0.4e-3, 3.0, False), (1.0e-3, 2.0, False)],
    ids=["half a period", "more margin asked for", "a period"],
)
def test_gains_of_today_stay_where_a_small_lag_leaves_the_gain_margin_at_any_phase(lag_s, asked, kept):
    """Half of the speed for a phase margin of 60 deg is more than a relay lag of 0.4 ms asks for."""
    least = {"least_gain_margin": asked, "least_phase_margin_deg": 60.0}
    loop = LinearLoop(time_constant_s=TAU, lag_s=lag_s)
    plain = tune(plant_gain=GAIN, time_constant_s=TAU, period_s=H, delay=0, **least)
    slower = tune_extended(loop, plant_gain=GAIN, period_s=H, delay=0, **least)
    found = tune_extended(loop, plant_gain=GAIN, period_s=H, delay=0, before=plain.gains, **least)
    assert found.kept_gains == kept
    assert found.gains == (plain.gains if kept else slower.gains)
    assert found.gain_margin >= asked
    if kept:
        assert slower.gains.ki < 0.75 * plain.gains.ki
        assert 29.0 < found.phase_margin_deg < 60.0
        assert "kept" in found.describe()


def test_an_unstable_loop_is_not_kept_for_its_small_sensitivity():
    """Far from -1 on the wrong side of it: gains ten times too large behind three periods of dead time."""
    loop = LinearLoop(time_constant_s=TAU, delay_s=3e-3)
    wild = PiGains(kp=2.0, ki=600.0)
    seen = extended_margins(wild, loop, plant_gain=GAIN, period_s=H, delay=0)
    assert seen.sensitivity_peak < 2.0
    assert not tune_extended(loop, plant_gain=GAIN, period_s=H, delay=0, before=wild, **ASKED).kept_gains


@pytest.mark.parametrize(
    ("identity", "values"),
    [
        ("actuation__delay", {"delay": 2.5e-3}),
        ("actuation__deadband", {"zone": 3.0}),
        ("thermal__second_time_constant", {"share": 0.3, "time_constant": 9e-3}),
        ("heater__tcr", {"tcr": 0.004}),
        ("thermal__latent_heat", {"heat": 4.0}),
        ("thermal__phase_heating", {"growth": 0.2}),
    ],
)
def test_played_open_loop_it_puts_the_models_deflection_on_the_setpoint(identity, values):
    made = simulation(**{identity: values})
    feedforward = ExtendedFeedforward(made.model, dynamics_of(made.model), Span(3.7, 8.5))
    time_s = PERIOD_S * np.arange(400)
    wanted = lambda t: 25.0 + 10.0 * np.sin(2.0 * np.pi * 8.0 * t)  # noqa: E731
    feedforward.start(3.7)
    current = [
        feedforward.step(float(wanted(t + PERIOD_S + feedforward.preview_s)), PERIOD_S) for t in time_s
    ]
    deflection = predict(made, stimulus(np.array([3.7, *current])))[1][1:]
    after = slice(60, 399)
    error = np.abs(deflection[after] - wanted(time_s[after]))
    assert error.mean() < 0.3, "um"
    assert feedforward.preview_s == pytest.approx(values.get("delay", 0.0))


@pytest.mark.parametrize("lag_s", [0.2e-3, 0.4e-3, 0.9e-3])
def test_behind_a_lag_of_less_than_a_period_a_step_is_not_crossed_and_crossed_back(lag_s):
    """Inverted within one period, heating and lag together ring: across the hysteresis they end on the other branch."""
    setpoints = [25.0] * 50 + [27.0] * 50
    made = simulation(hysteresis__rate_dependence={"time_constant": lag_s})
    ways = {}
    for name, feedforward in {
        "plain": InverseFeedforward(small_model(), Span(3.7, 8.5)),
        "lagging": ExtendedFeedforward(made.model, controlled(extended_model(made)), Span(3.7, 8.5)),
    }.items():
        feedforward.start(3.7)
        current = np.array([feedforward.step(one, PERIOD_S) for one in setpoints])
        ways[name] = np.abs(np.diff(current[45:])).sum()
    assert ways["lagging"] < 2.0 * ways["plain"], "mA, there and back"


def test_tuning_leaves_out_what_the_loop_tracked_worse_with():
    made = simulation(
        structure__resonance={"participation": 1.0, "frequency": 90.0, "damping_ratio": 0.05},
        hysteresis__rate_dependence={"time_constant": 3e-3},
        actuation__delay={"delay": 2e-3},
    )
    found = loop_dynamics(extended_model(made))
    assert found.used == ("actuation.delay", "hysteresis.rate_dependence")
    assert set(found.left_out) == {"structure.resonance"}
    assert (found.delay_s, found.participation, found.balance.lag_s) == (2e-3, 0.0, 3e-3)
