"""What a mechanism does that a model lacks, to the first order: by its force along the motion, and by the equation."""

from __future__ import annotations

import numpy as np
import pytest

from plant_sim.oscillator import motion
from plant_sim.oscillator.forces_of_mechanisms.departures import acts_as_a_force
from plant_sim.oscillator.mechanisms import MECHANISMS
from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.motion import Equation
from plant_sim.oscillator.simulation import OscillatorSimulation
from rtctl.border.arrays import FloatArray
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Stimulus

PERIOD_S, SAMPLES = 1e-3, 600
STOP = ("stop.one_sided", {"above": (4e4, "1/s^2"), "place": (1.5, "mm")})
BASES = {
    "stop": STOP,
    "damped stop": (STOP[0], {**STOP[1], "retardation_time": (1e-3, "s")}),
    "hysteresis": ("hysteresis.bouc_wen", {"level": (3000.0, "mm/s^2"), "displacement": (1.0, "mm")}),
    "friction": ("friction.coulomb", {"level": (500.0, "mm/s^2")}),
}
AMPLITUDES = {
    "friction.coulomb": ({"level": 1.0}, 5e-3),
    "damping.quadratic": ({"coefficient": 1e-6}, 1e-3),
    "damping.asymmetric": ({"coefficient": 1e-3}, 1e-3),
    "damping.power": ({"level": 0.2, "speed": 300.0, "exponent": 2.5}, 1e-3),
    "stiffness.quintic": ({"coefficient": 1e-4}, 1e-3),
    "stiffness.drift": ({"rate": 1.0}, 1e-3),
    "stiffness.parametric": ({"coefficient": 0.1}, 1e-3),
    "stiffness.clearance": ({"gap": 1e-4, "centre": 0.0}, 1e-3),
    "stiffness.viscoelastic": ({"stiffness": 1.0, "time_constant": 0.02}, 1e-3),
    "stiffness.gravity": ({"coefficient": 1.0, "radian": 20.0}, 1e-3),
    "stop.two_sided": ({"stiffness": 1.0, "lower": -2.0, "upper": 2.5}, 1e-3),
    "friction.presliding": ({"level": 1.0, "displacement": 0.5}, 2e-3),
    "hysteresis.bouc_wen": ({"level": 1.0, "displacement": 0.5}, 2e-3),
    "mode.second": ({"mass_ratio": 1e-4, "frequency": 60.0, "damping_ratio": 0.01}, 3e-3),
    "base.motion": ({"cosine": 1.0, "sine": 1.0, "frequency": 33.0}, 1e-3),
}


def simulation(base: str) -> OscillatorSimulation:
    identity, values = BASES[base]
    parameters = {
        "damping": {"value": 8.0, "unit": "1/s"}, "stiffness": {"value": 1.6e4, "unit": "1/s^2"},
        "drive_gain": {"value": 2e4, "unit": "mm/(s^2*V)"},
    }  # fmt: skip
    table = {"id": identity, "parameters": {k: {"value": v, "unit": u} for k, (v, u) in values.items()}}
    model = ModelFile.model_validate(
        {"model": {"kind": "oscillator", "parameters": parameters, "mechanisms": [table]}}
    )
    return oscillator_simulation(model, {"drive": "V", "displacement": "mm"}, "test")


def record() -> Stimulus:
    time_s = PERIOD_S * np.arange(SAMPLES)
    drive = sum(np.sin(2.0 * np.pi * f * time_s + f) for f in (9.0, 17.0, 23.0, 41.0))
    return Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)


def lanes(extended: OscillatorSimulation, added: str) -> FloatArray:
    """Without the mechanism (its shapes alone), and with a little of it."""
    values = np.tile([one.value for one in extended.parameters], (2, 1))
    given = AMPLITUDES[added][0]
    for k, one in enumerate(extended.parameters):
        if one.mechanism == added and one.declared.name in given:
            values[1:, k] = given[one.declared.name]
            if one.declared.neutral is None:
                values[0, k] = given[one.declared.name]
    return values


@pytest.mark.parametrize(
    ("base", "added"),
    [(base, added) for base, (own, _) in BASES.items() for added in AMPLITUDES if added != own],
)
def test_a_small_mechanism_departs_as_its_force_along_the_motion_makes_it(base: str, added: str) -> None:
    model = simulation(base)
    extended = model.extended((added,))
    values, tolerance = lanes(extended, added), AMPLITUDES[added][1]
    runs = (
        model.predict_departures(extended, record(), values, np.zeros(2)).outputs["displacement"],
        extended.predict(record(), values).outputs["displacement"],
    )
    first_order, whole = (run[1] - run[0] for run in runs)
    assert 1e-7 < np.abs(whole).max() < 1e-2
    assert np.linalg.norm(first_order - whole) < tolerance * np.linalg.norm(whole)


def test_no_kernel_is_made_of_the_model_and_the_mechanism() -> None:
    """Two memories together are a kernel that takes seconds to compile."""
    model = simulation("stop")
    model.predict(record(), np.array([one.value for one in model.parameters]))
    before = motion._integrator.cache_info().misses
    for added in ("friction.presliding", "friction.coulomb", "stiffness.drift", "damping.quadratic"):
        extended = model.extended((added,))
        model.predict_departures(extended, record(), lanes(extended, added), np.zeros(2))
    assert motion._integrator.cache_info().misses == before


def test_where_the_model_has_no_memory_the_whole_equation_is_integrated() -> None:
    """Its kernel is needed by the search for one cause as well, and follows many lanes at once."""
    values = np.array([[8.0, 1.6e4, 0.0, 2e4]])
    parameters = simulation("stop").parameters[:4]
    alone = Equation.of(parameters, [], values)
    for added in MECHANISMS.values():
        assert not acts_as_a_force(added, alone, alone)


def test_what_a_sensor_takes_from_the_drive_is_not_taken_from_the_force() -> None:
    """A second mode beside a stop, which the drive excites; the drive that stands for a force is no drive."""
    model = simulation("stop").extended(("mode.second",))
    shown = {"gain": 4e3, "frequency": 80.0, "damping_ratio": 0.02}
    model = model.with_values(
        np.array(
            [
                shown.get(one.declared.name, one.value) if one.mechanism == "mode.second" else one.value
                for one in model.parameters
            ]
        )
    )
    extended = model.extended(("friction.presliding",))
    of_all = lanes(extended, "friction.presliding")
    runs = (
        model.predict_departures(extended, record(), of_all, np.zeros(2)).outputs["displacement"],
        extended.predict(record(), of_all).outputs["displacement"],
    )
    first_order, whole = (run[1] - run[0] for run in runs)
    assert np.linalg.norm(first_order - whole) < 2e-3 * np.linalg.norm(whole)
