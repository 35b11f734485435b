"""The splitting: exact where the oscillator is linear, of order 2, RK4's motion, chosen where it is cheaper."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from plant_sim.oscillator.equation.terms import NOMINAL, TERMS
from plant_sim.oscillator.integration.holds import nodes
from plant_sim.oscillator.integration.steps import Plan, plan, splitting_steps
from plant_sim.oscillator.mechanism import Driven
from plant_sim.oscillator.motion import Equation

FloatArray = NDArray[np.float64]
W = 40.0
"""Angular frequency of the linear part [1/s]."""


def equation(lanes: int = 1, **rows: float) -> Equation:
    table = np.zeros((len(TERMS), lanes))
    for name, value in {"gain": 1.0, "damping": 0.0, "stiffness": W**2, **rows}.items():
        table[TERMS.index(name)] = value
    return Equation(rows=table, terms=NOMINAL | frozenset(rows), memories=())


def march(
    model: Equation,
    how: Plan,
    drive: FloatArray,
    period_s: float,
    start: tuple[float, float],
    hold: str = "linear",
) -> tuple[FloatArray, FloatArray]:
    driven = Driven(nodes(drive, hold, how.substeps), period_s / how.substeps)
    z, v = model.integrate(driven, how, np.array([start]))
    return z[0], v[0]


def energy_swing(how: Plan, model: Equation, periods: int, period_s: float) -> float:
    """Largest change of the energy of the undriven orbit from z = 1, in parts of it."""
    z, v = march(model, how, np.zeros(periods + 1), period_s, (1.0, 0.0))
    p = dict(zip(TERMS, model.rows[:, 0], strict=True))
    potential = (
        p["stiffness"] * z**2 / 2
        + p["quadratic"] * z**3 / 3
        + p["cubic"] * z**4 / 4
        + p["quintic"] * z**6 / 6
    )
    energy = v**2 / 2 + potential
    return float(np.abs(energy / energy[0] - 1.0).max())


@pytest.mark.parametrize("damping", [0.0, 3.0, 2.0 * W, 300.0])
@pytest.mark.parametrize("stiffness", [W**2, 0.0, -50.0])
def test_a_linear_oscillator_under_a_ramp_is_exact_at_any_step(damping: float, stiffness: float) -> None:
    h = 0.05  # a third of a period
    drive = np.array([100.0, 250.0])
    z, v = march(equation(damping=damping, stiffness=stiffness), Plan(1, True), drive, h, (0.3, -2.0))
    fine = march(
        equation(damping=damping, stiffness=stiffness), Plan(20_000, False), drive, h, (0.3, -2.0)
    )  # fmt: skip
    assert z[1] == pytest.approx(fine[0][1], rel=1e-11)
    assert v[1] == pytest.approx(fine[1][1], rel=1e-11)


def test_an_undamped_linear_oscillator_turns_by_its_angle_to_rounding() -> None:
    period_s, count = 0.0173, 2000
    ramp = 500.0 * np.arange(count + 1) * period_s  # z'' + W^2 z = 500 t
    z, _ = march(equation(), Plan(1, True), ramp, period_s, (0.7, 11.0))
    t = period_s * np.arange(count + 1)
    exact = 500.0 * t / W**2 + 0.7 * np.cos(W * t) + (11.0 - 500.0 / W**2) / W * np.sin(W * t)
    assert np.abs(z - exact).max() < 1e-12 * count**0.5 * np.abs(exact).max()


def test_a_held_drive_is_exact_too() -> None:
    rng = np.random.default_rng(2)
    drive, period_s = rng.standard_normal(50) * 100, 0.02
    model = equation(damping=5.0)
    z, _ = march(model, Plan(1, True), drive, period_s, (0.0, 0.0), "zero")
    fine, _ = march(model, Plan(4000, False), drive, period_s, (0.0, 0.0), "zero")
    assert np.abs(z - fine).max() < 1e-12


@pytest.mark.parametrize("force", [{"cubic": 900.0}, {"quadratic": 300.0, "quintic": 500.0}])
def test_it_is_of_order_two_and_converges_to_rk4s_motion(force: dict[str, float]) -> None:
    rng = np.random.default_rng(5)
    drive = np.convolve(rng.standard_normal(400) * 600, np.ones(5) / 5, "same")
    model, period_s = equation(damping=4.0, **force), 0.01
    fine_z, fine_v = march(model, Plan(128, False), drive, period_s, (0.4, 0.0))
    errors = []
    for substeps in (8, 16, 32):
        z, v = march(model, Plan(substeps, True), drive, period_s, (0.4, 0.0))
        errors.append((np.abs(z - fine_z).max(), np.abs(v - fine_v).max()))
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert np.all((ratios > 3.7) & (ratios < 4.3))


def test_lanes_march_as_each_alone() -> None:
    drive = 300.0 * np.sin(0.3 * np.arange(60))
    table = equation(3, cubic=200.0, damping=2.0).rows
    table[TERMS.index("cubic")] *= [0.5, 1.0, 2.0]
    together = Equation(rows=table, terms=NOMINAL, memories=())
    driven = Driven(nodes(drive, "linear", 4), 0.005)
    z, _ = together.integrate(driven, Plan(4, True), np.zeros((3, 2)))
    for lane in range(3):
        alone = Equation(rows=np.ascontiguousarray(table[:, [lane]]), terms=NOMINAL, memories=())
        assert np.array_equal(z[lane], alone.integrate(driven, Plan(4, True), np.zeros((1, 2)))[0][0])


@pytest.mark.parametrize("term", ["cubic", "quadratic", "quintic"])
@pytest.mark.parametrize("share", [1e-7, 1e-5, 1e-3, 1e-2, 0.1])
def test_the_rule_keeps_the_energy_within_a_millionth_over_a_thousand_periods(
    term: str, share: float
) -> None:
    model = equation(**{term: share * W**2})
    assert model.share(1.0) == pytest.approx(share)
    rate, _ = model.rates(1.0)
    steps = splitting_steps(share, parabolic=True)
    period_s = 2.0 * math.pi / rate / steps
    assert energy_swing(Plan(1, True), model, int(1000 * steps), period_s) < 1e-6


def test_the_rule_is_not_ten_times_too_careful() -> None:
    model = equation(cubic=0.01 * W**2)
    rate, _ = model.rates(1.0)
    steps = splitting_steps(0.01, parabolic=True) / math.sqrt(10.0)
    assert energy_swing(Plan(1, True), model, 1000, 2.0 * math.pi / rate / steps) > 1e-6


def test_weak_nonlinearity_is_split_and_strong_one_is_not() -> None:
    period_s = 2.0 * math.pi / W / 20.0
    weak, strong = equation(cubic=1e-3 * W**2), equation(cubic=W**2)
    assert weak.plan(period_s, 1.0, "linear") == Plan(7, True)
    assert not strong.plan(period_s, 1.0, "linear").splitting
    assert equation().plan(period_s, 1.0, "linear") == Plan(1, True)
    assert equation().plan(period_s, 1.0, "band-limited") == Plan(4, True)
    assert equation(stiffness=0.0).plan(period_s, 1.0, "zero") == Plan(1, True)


@pytest.mark.parametrize(
    "terms",
    [
        {"damping_2": 1.0},
        {"friction": 1.0},
        {"parametric": 1.0},
        {"drift": 1.0},
        {"stiffness": -9.0, "cubic": 1.0},
    ],
)
def test_what_no_splitting_knows_is_left_to_rk4(terms: dict[str, float]) -> None:
    assert not equation(**terms).plan(0.001, 1.0, "linear").splitting


def test_a_drive_that_mechanisms_made_is_left_to_rk4_and_so_is_a_given_number_of_steps() -> None:
    assert not equation().plan(0.01, 1.0, "").splitting
    assert equation().plan(0.01, 1.0, "linear", 64.0) == Plan(5, False)


def test_both_methods_refuse_a_pole_beyond_reason() -> None:
    with pytest.raises(ValueError, match="check the units"):
        plan(1.0, 1e9, 0.0, 0.0, parabolic=True, steps_per_period=None)
