"""Friction that is smooth at its turns, that fades from its break-away level, and the arithmetic that both rest on."""

from __future__ import annotations

import math

import numpy as np
import pytest
from duffing_cases import (
    STIFFNESS,
    UNITS,
    V_0,
    Z_0,
    FloatArray,
    duffing,
    lane,
    model,
    multisine,
    simulation,
    solved,
    stick_slip,
)
from duffing_cases import stimulus as record_of
from mechanism_oracles import stribeck

from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.simulation import OscillatorSimulation
from rtctl.border.work import metered

LEVEL = 350.0
TOP_SPEED = 15.0
"""Of the motion [mm/s]."""


def predicted(identity: str, steps_per_period: float | None = None, **values: float) -> FloatArray:
    bound = simulation(identity)
    own = lane(bound, {f"{identity}.{name}": value for name, value in values.items()})
    run = bound.predict(record_of(multisine()), own, steps_per_period=steps_per_period)
    return run.outputs["displacement"][0]


def off(found: FloatArray, expected: FloatArray) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


@pytest.mark.parametrize(("level", "share"), [(LEVEL, 0.3), (LEVEL, 0.05), (LEVEL, 0.01), (60.0, 0.01)])
def test_a_smooth_sign_is_that_of_scipy_at_the_steps_of_fits_too(level: float, share: float) -> None:
    width = share * TOP_SPEED
    y = solved(
        lambda t, y, u: [y[1], duffing(y[0], y[1], u) - level * math.tanh(y[1] / width)],
        multisine(), "linear", [Z_0, V_0],
    )  # fmt: skip
    expected = y[:, 0]
    assert off(predicted("friction.coulomb", level=level), expected) > 1e-4
    assert off(predicted("friction.coulomb", level=level, transition_speed=width), expected) < 1e-6
    assert off(predicted("friction.coulomb", 64.0, level=level, transition_speed=width), expected) < 5e-5


@pytest.mark.parametrize("over_acceleration", [1e-2, 1e-4])
@pytest.mark.parametrize("share", [0.01, 0.001])
def test_steps_resolve_a_smooth_sign_as_far_as_its_force_matters(
    over_acceleration: float, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    values = {
        "level": over_acceleration * TOP_SPEED * math.sqrt(STIFFNESS),
        "transition_speed": share * TOP_SPEED,
    }
    found, at_fits = (predicted("friction.coulomb", steps, **values) for steps in (None, 64.0))
    monkeypatch.setattr("plant_sim.oscillator.motion.WEAK", 1e-12)
    expected = predicted("friction.coulomb", 1024.0, **values)
    assert off(found, expected) < 1e-6
    assert off(at_fits, expected) < 1e-5


def test_a_weak_friction_asks_for_no_shorter_steps() -> None:
    bound = simulation("friction.coulomb")
    level = 1e-6 * TOP_SPEED * math.sqrt(STIFFNESS)
    weak, sharp = (
        work_of(bound, {"friction.coulomb.level": level, "friction.coulomb.transition_speed": width})
        for width in (10.0 * TOP_SPEED, 1e-3 * TOP_SPEED)
    )
    assert sharp < 1.1 * weak


def work_of(bound: OscillatorSimulation, own: dict[str, float]) -> float:
    with metered() as meter:
        bound.predict(record_of(multisine()), lane(bound, own))
    return meter.steps


def test_a_smooth_sign_of_no_width_is_the_ideal_one_without_its_rest() -> None:
    ideal = predicted("friction.coulomb", level=LEVEL)
    errors = [
        off(predicted("friction.coulomb", level=LEVEL, transition_speed=share * TOP_SPEED), ideal)
        for share in (1e-2, 1e-3)
    ]
    assert errors[1] < 0.3 * errors[0]


@pytest.mark.parametrize("transition_speed", [4.0, 1.0])
def test_friction_that_fades_holds_at_its_break_away_level(transition_speed: float) -> None:
    p = {"level": 250.0, "excess": 150.0, "transition_speed": transition_speed}
    y = stick_slip(multisine(), "linear", stribeck(0.0, p), sliding=lambda v: stribeck(v, p))
    assert np.count_nonzero(y[:, 1] == 0.0) > 20
    assert off(predicted("friction.stribeck", **p), y[:, 0]) < 2e-5


def test_friction_without_an_excess_is_that_of_coulomb() -> None:
    found = predicted("friction.stribeck", level=LEVEL, excess=0.0, transition_speed=50.0)
    assert off(found, predicted("friction.coulomb", level=LEVEL)) < 2e-6


def test_lanes_with_an_ideal_and_a_smooth_sign_march_as_each_alone() -> None:
    bound = simulation("friction.coulomb")
    values = [
        lane(bound, {"friction.coulomb.level": LEVEL, "friction.coulomb.transition_speed": width})
        for width in (0.0, 2.0)
    ]
    both = bound.predict(record_of(multisine()), np.array(values)).outputs["displacement"]
    for found, own in zip(both, values, strict=True):
        alone = bound.predict(record_of(multisine()), own).outputs["displacement"][0]
        assert off(found, alone) < 2e-5  # the common steps are those of the smooth one


@pytest.mark.parametrize("more", [{}, {"transition_speed": (0.0, "mm/s")}])
def test_a_file_without_a_transition_speed_has_the_ideal_sign_and_nothing_to_fit(
    more: dict[str, tuple[float, str]],
) -> None:
    values = {"level": (LEVEL, "mm/s^2"), **more}
    bound = oscillator_simulation(model(("friction.coulomb", values)), UNITS, "test")
    transition = bound.parameters[-1]
    assert (transition.name, transition.value, transition.fixed) == (
        "friction.coulomb.transition_speed",
        0.0,
        True,
    )
    run = bound.predict(record_of(multisine()), lane(bound, {})).outputs["displacement"][0]
    assert np.array_equal(run, predicted("friction.coulomb", level=LEVEL))
