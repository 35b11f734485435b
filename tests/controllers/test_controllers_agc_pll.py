"""AGC and PLL: gains by formula, the start, the gate, the limits; and the slow flow of a resonator under them."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

from rtctl.controllers.agc_pll import AgcPllController, AgcPllOptions, turned
from rtctl.controllers.agc_pll_tuning import loop_delay_s, tune_agc_pll
from rtctl.interfaces import Estimate, EstimateStatus
from rtctl.models.resonator import ResonatorModel

F0 = 7500.0
MODEL = ResonatorModel(
    damping=2.0 * math.pi * F0 / 400.0,
    stiffness=(2.0 * math.pi * F0) ** 2,
    cubic=1.9e7,
    quintic=0.0,
    drive_gain=3.74e4,
    identity="",
)
PERIOD_S = 5e-4
TUNING = tune_agc_pll(MODEL, period_s=PERIOD_S, delay=0, separation=5.0)


def estimate(amplitude: float, phase_deg: float = -90.0, error: float = 1e-4, status: int = 0) -> Estimate:
    return Estimate(amplitude, phase_deg, error, status)


def started(**options: float) -> AgcPllController:
    controller = AgcPllController(MODEL, TUNING, AgcPllOptions(**options))
    controller.start((0.0, F0), 0.5, estimate(0.0))
    return controller


def test_gains_cancel_the_pole_of_the_resonator_and_keep_a_quarter_of_the_delay() -> None:
    tau = PERIOD_S + 0.5 / F0
    assert TUNING.delay_s == pytest.approx(tau)
    assert TUNING.phase_bandwidth == pytest.approx(0.25 / tau)
    assert TUNING.amplitude_bandwidth == pytest.approx(0.05 / tau)
    sigma = math.pi * F0 / 400.0
    assert TUNING.ki_hz_per_deg_s == pytest.approx(sigma * TUNING.kp_hz_per_deg)
    assert TUNING.ki_mA_per_um_s == pytest.approx(sigma * TUNING.kp_mA_per_um)
    # Kp [rad/s a rad] as Hz a degree, and g Kp = bandwidth
    assert TUNING.kp_hz_per_deg == pytest.approx(0.25 / tau / (2.0 * math.pi) * math.pi / 180.0)
    assert TUNING.kp_mA_per_um * MODEL.drive_gain / (2.0 * 2.0 * math.pi * F0) == pytest.approx(0.05 / tau)
    assert TUNING.phase_margin_deg(TUNING.phase_bandwidth) == pytest.approx(90.0 - math.degrees(0.25))


def test_a_live_reading_is_a_period_late_and_halves_the_bandwidth() -> None:
    live = tune_agc_pll(MODEL, period_s=PERIOD_S, delay=1, separation=5.0)
    assert live.delay_s - TUNING.delay_s == pytest.approx(PERIOD_S)
    assert live.phase_bandwidth == pytest.approx(0.25 / loop_delay_s(PERIOD_S, 1, MODEL.resonance))


@pytest.mark.parametrize("name", ["phase_bandwidth", "amplitude_bandwidth"])
def test_a_bandwidth_that_the_delay_does_not_allow_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=r"at most 70.\d+ Hz"):
        tune_agc_pll(MODEL, period_s=PERIOD_S, delay=0, separation=5.0, **{name: 500.0})


def test_without_a_response_it_gives_a_kick_and_holds_the_frequency() -> None:
    controller = started(kick=0.5, gate=20.0)
    for _ in range(200):
        action = controller.step(0.5, 0.5, estimate(1.9e-3, phase_deg=10.0), PERIOD_S)
        controller.applied(action.levels)
    assert action.levels == (pytest.approx(0.5 * MODEL.holding_current(0.5)), F0)
    assert action.terms.state == 0.0


@pytest.mark.parametrize("broken", [{"status": int(EstimateStatus.NOT_FINITE)}, {"error": math.nan}])
def test_an_estimate_that_claims_nothing_is_no_response(broken: dict) -> None:
    action = started().step(0.5, 0.5, estimate(0.4, **broken), PERIOD_S)
    assert action.terms.state == 0.0
    assert action.levels[1] == F0


def test_off_phase_the_frequency_is_controlled_and_the_current_stays_a_kick() -> None:
    action = started().step(0.5, 0.5, estimate(0.1, phase_deg=-20.0), PERIOD_S)
    assert action.terms.state == 1.0
    assert action.levels[0] == pytest.approx(0.5 * MODEL.holding_current(0.5))
    assert action.levels[1] > F0, "the displacement is too far ahead: the drive is too slow"


def test_a_response_that_is_lost_gives_the_current_back() -> None:
    controller = started()
    for _ in range(100):
        action = controller.step(0.5, 0.5, estimate(0.1), PERIOD_S)
        controller.applied(action.levels)
    assert action.levels[0] > MODEL.holding_current(0.5)
    lost = controller.step(0.5, 0.5, estimate(1e-3), PERIOD_S)
    assert lost.levels[0] == pytest.approx(0.5 * MODEL.holding_current(0.5))


def test_behind_a_limit_nothing_winds_up() -> None:
    controller = started()
    for _ in range(1000):
        action = controller.step(0.9, 0.9, estimate(0.3), PERIOD_S)
        controller.applied((50.0, min(action.levels[1], 7501.0)))
    arrived = controller.step(0.3, 0.3, estimate(0.3), PERIOD_S)
    assert arrived.levels[0] == pytest.approx(MODEL.holding_current(0.3)), "at once, without a tail"


def test_the_frequency_integral_stays_within_reach_of_its_limit() -> None:
    controller = started()
    for _ in range(1000):
        action = controller.step(0.5, 0.5, estimate(0.5, phase_deg=-60.0), PERIOD_S)
        controller.applied((action.levels[0], min(action.levels[1], 7510.0)))
    back = controller.step(0.5, 0.5, estimate(0.5, phase_deg=-91.0), PERIOD_S)
    assert back.levels[1] < 7510.0


def test_phases_are_compared_on_the_circle() -> None:
    assert turned(270.0) == -90.0
    assert turned(-181.0) == 179.0
    assert math.isnan(turned(math.nan))


def slow_flow(controller: AgcPllController, setpoint: float, start_hz: float, seconds: float) -> np.ndarray:
    """The averaged resonator by its own equation: A' = -sigma A + i (w_b(|A|) - w) A - i g I; rows a, phi, I, f."""
    sigma, growth = MODEL.decay, MODEL.growth
    phasor, levels, rows = 0.0 + 0.0j, (0.0, F0), []
    for _ in range(round(seconds / PERIOD_S)):
        for _ in range(20):
            bend = 3.0 * MODEL.cubic * abs(phasor) ** 2 / (8.0 * MODEL.resonance)
            detuning = 2.0 * math.pi * (start_hz - levels[1]) + bend
            slope = (-sigma + 1j * detuning) * phasor - 1j * growth * levels[0]
            phasor += slope * PERIOD_S / 20
        seen = estimate(abs(phasor), math.degrees(cmath.phase(phasor)) if phasor else 0.0)
        action = controller.step(setpoint, setpoint, seen, PERIOD_S)
        levels = (min(max(action.levels[0], 0.0), 250.0), min(max(action.levels[1], 7400.0), 7600.0))
        controller.applied(levels)
        rows.append((abs(phasor), seen.surrogate, *levels))
    return np.array(rows)


@pytest.mark.parametrize("off_hz", [0.0, 30.0, -30.0])
@pytest.mark.parametrize("setpoint", [0.1, 1.0])
def test_it_locks_and_holds_also_where_the_model_is_off(off_hz: float, setpoint: float) -> None:
    rows = slow_flow(started(), setpoint, F0 + off_hz, 0.5)
    amplitude, phase, current, frequency = rows[-1]
    assert amplitude == pytest.approx(setpoint, rel=1e-4)
    assert phase == pytest.approx(-90.0, abs=0.05)
    bend = 3.0 * MODEL.cubic * setpoint**2 / (8.0 * MODEL.resonance) / (2.0 * math.pi)
    assert frequency == pytest.approx(F0 + off_hz + bend, abs=0.02)
    assert current == pytest.approx(MODEL.holding_current(setpoint), rel=1e-3)


def test_a_step_settles_with_the_bandwidth_of_the_agc() -> None:
    rows = slow_flow(started(), 0.5, F0, 0.3)
    outside = np.flatnonzero(np.abs(rows[:, 0] - 0.5) > 0.001 * 0.5)
    settled_s = PERIOD_S * (outside[-1] + 1)
    assert settled_s < 1.5 * math.log(1000.0) / TUNING.amplitude_bandwidth
    assert rows[:, 0].max() < 1.02 * 0.5
