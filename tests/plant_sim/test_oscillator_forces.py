"""The force of a mechanism along a motion, against its formula and against the equation that made the motion."""

from __future__ import annotations

import numpy as np
import pytest
from test_oscillator_departures import PERIOD_S, lanes, record, simulation

from plant_sim.oscillator.simulation import OscillatorSimulation
from rtctl.border.arrays import FloatArray


def motion_of(model: OscillatorSimulation) -> tuple[FloatArray, FloatArray]:
    run = model.predict(record(), np.array([one.value for one in model.parameters]))
    return run.outputs["displacement"][0], run.outputs["velocity"][0]


def forces(added: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Displacement, velocity and mean force of the mechanism over each sample period."""
    model = simulation("hysteresis")
    z, v = motion_of(model)
    extended = model.extended((added,))
    found = model.forces_along(extended, record(), lanes(extended, added)[1:], z, v)
    assert found is not None
    assert found.shape == (1, len(z) - 1)
    return z, v, found[0]


FORMULAS = {
    "damping.quadratic": lambda z, v, t: -1e-6 * np.abs(v) * v,
    "damping.asymmetric": lambda z, v, t: -1e-3 * np.abs(v),
    "damping.power": lambda z, v, t: -0.2 * np.sign(v) * np.abs(v / 300.0) ** 2.5,
    "friction.coulomb": lambda z, v, t: -1.0 * np.sign(v),
    "stiffness.quintic": lambda z, v, t: -1e-4 * z**5,
    "stiffness.drift": lambda z, v, t: -1.0 * t * z,
    "stop.two_sided": lambda z, v, t: -1.0 * (np.maximum(z - 2.5, 0.0) + np.minimum(z + 2.0, 0.0)),
    "base.motion": lambda z, v, t: np.cos(66.0 * np.pi * t) + np.sin(66.0 * np.pi * t),
}


@pytest.mark.parametrize("added", FORMULAS)
def test_it_is_that_of_the_formula(added: str) -> None:
    z, v, found = forces(added)
    t = PERIOD_S * np.arange(len(z))
    at_samples = FORMULAS[added](z, v, t)
    mean = 0.5 * (at_samples[1:] + at_samples[:-1])
    turning = np.sign(v[1:]) != np.sign(v[:-1])
    error = np.where(turning & (added == "friction.coulomb"), 0.0, found - mean)
    assert np.abs(found).max() > 0.0
    assert np.linalg.norm(error) < 0.02 * np.linalg.norm(found)


def test_a_memory_follows_the_motion() -> None:
    """A relaxing spring: w' = z' - w / tau."""
    z, _, found = forces("stiffness.viscoelastic")
    w, kept = np.zeros(len(z)), np.exp(-PERIOD_S / 0.02)
    for k in range(1, len(z)):
        w[k] = kept * w[k - 1] + 0.02 / PERIOD_S * (1.0 - kept) * (z[k] - z[k - 1])
    mean = -0.5 * (w[1:] + w[:-1])
    assert np.linalg.norm(found - mean) < 0.02 * np.linalg.norm(mean)


def test_what_changes_the_drive_is_the_force_of_the_change() -> None:
    model = simulation("hysteresis")
    extended = model.extended(("drive.offset",))
    values = np.array([[one.value for one in extended.parameters]])
    values[0, -1] = 0.3
    found = model.forces_along(extended, record(), values, *motion_of(model))
    assert found is not None
    np.testing.assert_allclose(found, 2e4 * 0.3)


@pytest.mark.parametrize("added", ["sensor.lag", "sensor.saturation"])
def test_a_sensor_exerts_none(added: str) -> None:
    model = simulation("hysteresis")
    extended = model.extended((added,))
    values = np.array([[one.value + 1e-3 for one in extended.parameters]])
    assert model.forces_along(extended, record(), values, *motion_of(model)) is None
