"""Free play, stops, gravity, backlash and a moving base: limits, units, and what is over within a step."""

from __future__ import annotations

import math

import numba
import numpy as np
import pytest
from duffing_cases import (
    PERIOD_S,
    STIFFNESS,
    UNITS,
    FloatArray,
    lane,
    model,
    multisine,
    simulation,
    stimulus,
)
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from plant_sim.oscillator.equation.sine import sine
from plant_sim.oscillator.integration.play import follow_play
from plant_sim.oscillator.mechanism import in_units
from plant_sim.oscillator.mechanisms import MECHANISMS
from plant_sim.oscillator.model import oscillator_simulation
from rtctl.border.errors import InputError
from rtctl.border.simulation import Stimulus

GRAVITY = MECHANISMS["stiffness.gravity"]


def moved(identity: str, steps_per_period: float | None = None, **values: float) -> FloatArray:
    """Displacement (samples,) with one mechanism."""
    bound = simulation(identity)
    own = {f"{identity}.{name}": value for name, value in values.items()}
    found = bound.predict(stimulus(multisine()), lane(bound, own), steps_per_period=steps_per_period)
    return found.outputs["displacement"][0]


def test_the_sine_is_that_of_the_library() -> None:
    @numba.njit
    def series(x: FloatArray) -> FloatArray:
        out = np.empty_like(x)
        for k in range(len(x)):
            out[k] = sine(x[k])
        return out

    for far in (0.1, 7.0, 6000.0):
        x = np.linspace(-far, far, 200_001)
        assert np.abs(series(x) - np.sin(x)).max() < 1e-15


@pytest.mark.parametrize("gap", [0.0005, 0.003, 0.03])
def test_play_that_is_crossed_within_a_step_acts_as_in_short_steps(gap: float) -> None:
    """At the 64 steps a period of a diagnosis the motion crosses 0.0005 mm in a hundredth of a step."""
    fine, none = moved("stiffness.clearance", 8192.0, gap=gap), moved("stiffness.clearance", 8192.0)
    coarse = moved("stiffness.clearance", 64.0, gap=gap)
    assert np.std(fine - none) > 0.01 * np.std(none)
    assert np.std(coarse - fine) < 1e-4 * np.std(fine - none)


def test_a_device_rests_anywhere_in_its_play() -> None:
    bound = simulation("stiffness.clearance")
    values = lane(bound, {"stiffness.clearance.gap": 0.05, "stiffness.clearance.centre": 1.0})
    for start, moves in ((0.001, False), (0.099, False), (0.101, True), (-0.001, True)):
        record = Stimulus(
            inputs={"drive": np.zeros(50)}, holds={"drive": "linear"}, period_s=PERIOD_S,
            initial={"displacement": start},
        )  # fmt: skip
        found = bound.predict(record, values).outputs["displacement"][0]
        assert (np.ptp(found) > 0.0) == moves


def test_two_stops_are_a_stop_on_each_side() -> None:
    both = moved("stop.two_sided", stiffness=2e4, lower=-0.05, upper=0.06)
    upper = moved("stop.two_sided", stiffness=2e4, lower=-9.0, upper=0.06)
    assert upper == pytest.approx(moved("stop.one_sided", above=2e4, place=0.06), abs=1e-12)
    lower = moved("stop.two_sided", stiffness=2e4, lower=-0.05, upper=9.0)
    assert lower == pytest.approx(moved("stop.one_sided", below=2e4, place=-0.05), abs=1e-12)
    assert both.max() == pytest.approx(upper.max(), rel=0.3)
    assert both.min() > upper.min() and both.max() < lower.max()  # noqa: PT018


@pytest.mark.parametrize("rubs", [False, True])
def test_a_damper_that_acts_on_the_stop_alone_costs_no_accuracy(rubs: bool) -> None:
    """Its force jumps at the touch: integrated as it stands, it is off by 2e-3 of the peak at 256 steps a period."""
    stop = {f"stop.one_sided.{name}": value for name, value in
            {"above": 3e4, "place": 0.04, "retardation_time": 2e-3}.items()}  # fmt: skip
    bound = simulation("stop.one_sided", *(["friction.coulomb"] if rubs else []))
    values = lane(bound, stop | ({"friction.coulomb.level": 200.0} if rubs else {}))

    def at(steps_per_period: float) -> FloatArray:
        found = bound.predict(stimulus(multisine()), values, steps_per_period=steps_per_period)
        return np.concatenate([found.outputs[name][0] for name in ("displacement", "velocity")]).reshape(
            2, -1
        )

    fine, usual = at(16384.0), at(256.0)
    assert fine[0].max() > 0.05
    off = np.abs(usual - fine).max(axis=1) / np.abs(fine).max(axis=1)
    assert off.max() < 5e-5


def test_a_motion_that_starts_on_a_lossy_stop_has_the_velocity_that_it_was_given() -> None:
    bound = simulation("stop.one_sided")
    values = lane(bound, {"stop.one_sided.above": 2e4, "stop.one_sided.place": 0.0,
                          "stop.one_sided.retardation_time": 1e-3})  # fmt: skip
    record = Stimulus(
        inputs={"drive": np.zeros(50)}, holds={"drive": "linear"}, period_s=PERIOD_S,
        initial={"displacement": 0.1, "velocity": 3.0},
    )  # fmt: skip
    found = bound.predict(record, values).outputs
    assert found["velocity"][0, 0] == 3.0
    assert found["displacement"][0, 0] == 0.1


def test_small_swings_of_a_pendulum_have_the_nominal_stiffness_and_gravity_alone_is_a_sine() -> None:
    small = moved("stiffness.gravity", coefficient=STIFFNESS, radian=1e6)
    assert np.abs(small - moved("stiffness.gravity", radian=1e6)).max() < 1e-9
    bound = simulation("stiffness.gravity", stiffness_cubic=0.0)
    values = lane(bound, {"stiffness.gravity.coefficient": STIFFNESS, "stiffness.gravity.radian": 0.1})
    times = PERIOD_S * np.arange(200)
    record = Stimulus(
        inputs={"drive": np.zeros(200)}, holds={"drive": "linear"}, period_s=PERIOD_S,
        initial={"displacement": 0.25},
    )  # fmt: skip
    exact = solve_ivp(
        lambda t, y: [y[1], -4.0 * y[1] - STIFFNESS * 0.1 * math.sin(y[0] / 0.1)], (0.0, times[-1]), [0.25, 0.0],
        t_eval=times, rtol=1e-11, atol=1e-12,
    ).y[0]  # fmt: skip
    found = bound.predict(record, values).outputs["displacement"][0]
    assert np.abs(found - exact).max() < 1e-7


@pytest.mark.parametrize(("unit", "radian"), [("rad", 1.0), ("deg", 180.0 / math.pi), ("mrad", 1000.0)])
def test_an_angle_is_known_in_its_unit(unit: str, radian: float) -> None:
    bound = in_units(GRAVITY, {"drive": "V", "displacement": unit})
    default = next(one.default for one in bound.parameters if one.name == "radian")
    assert default == pytest.approx(radian)
    assert bound.suits_data


@pytest.mark.parametrize("unit", ["mm", "V", "count", "percent", "dimensionless"])
def test_a_displacement_that_is_no_angle_needs_its_radian(unit: str) -> None:
    assert not in_units(GRAVITY, {"drive": "V", "displacement": unit}).suits_data
    if unit == "mm":
        with pytest.raises(InputError, match=r"parameters.radian \[mm\] of stiffness.gravity is missing"):
            oscillator_simulation(
                model(("stiffness.gravity", {"coefficient": (9.0, "1/s^2")})), UNITS, "test"
            )


@given(st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=60), st.floats(0.0, 3.0))
def test_a_play_follows_within_its_width_and_moves_no_more_than_it_must(
    drive: list[float], width: float
) -> None:
    nodes = np.repeat(np.array(drive), 3).reshape(-1, 3)
    out, state = np.empty_like(nodes), np.zeros(1)
    follow_play(state, nodes, width, out)
    w = out[:, 2]
    assert (np.abs(w - drive) <= width + 1e-12).all()
    before = np.append(0.0, w[:-1])
    stays = np.abs(before - drive) <= width
    assert (w[stays] == before[stays]).all()
    assert np.allclose(np.abs(w - drive)[~stays], width)
    assert state[0] == w[-1]


def test_a_base_that_moves_goes_on_in_phase_for_thousands_of_periods() -> None:
    """The phase is two states of the integrator, which must not lose it: RK4's own error is 1e-9 a step."""
    bound = simulation("base.motion", stiffness_cubic=0.0)
    w, n = 2.0 * math.pi * 31.0, 60_000
    values = lane(bound, {"base.motion.cosine": 100.0, "base.motion.frequency": 31.0})
    record = Stimulus(inputs={"drive": np.zeros(n)}, holds={"drive": "linear"}, period_s=PERIOD_S)
    found = bound.predict(record, values).outputs["displacement"][0][-900:]
    t = PERIOD_S * np.arange(n)[-900:]
    settled = (100.0 * np.exp(1j * w * t) / (STIFFNESS - w * w + 4j * w)).real
    assert np.abs(found - settled).max() < 2e-3 * np.abs(settled).max()


def test_a_base_pushes_where_no_drive_does() -> None:
    bound = simulation("base.motion", drive_gain=0.0)
    values = lane(bound, {"base.motion.sine": 50.0, "base.motion.frequency": 9.0})
    assert bound.predict(stimulus(multisine()), values).outputs["displacement"].std() > 1e-3
