"""A sweep's stroboscopic map is the motion itself, looked at once a period."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from plant_sim.oscillator.mechanisms import MECHANISMS
from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.motion import Equation
from plant_sim.oscillator.sweep import follow, sweep
from rtctl.border.model_file import ModelFile

DAMPING, STIFFNESS, CUBIC = 2.0, -4275.6, 88.2
AMPLITUDE = 3810.0
NUMBERS = {
    "damping": (DAMPING, "1/s"), "stiffness": (STIFFNESS, "1/s^2"), "stiffness_cubic": (CUBIC, "1/(mm^2*s^2)"),
    "drive_gain": (1.0, "dimensionless"),
}  # fmt: skip


def beam(lanes: int, *mechanisms: str) -> Equation:
    """The bistable beam [mm], the drive in mm/s^2."""
    parameters = {name: {"value": value, "unit": unit} for name, (value, unit) in NUMBERS.items()}
    model = ModelFile.model_validate({"model": {"kind": "oscillator", "parameters": parameters}})
    simulation = oscillator_simulation(model, {"drive": "mm/s^2", "displacement": "mm"}, "test")
    simulation = simulation.extended(mechanisms)
    values = np.tile([parameter.value for parameter in simulation.parameters], (lanes, 1))
    return Equation.of(simulation.parameters, [MECHANISMS[name] for name in mechanisms], values)


def test_rows_of_the_map_are_scipys_solution_once_a_period() -> None:
    frequency = 9.0
    starts = np.array([[7.0, 0.0], [-6.5, 20.0]])
    found = follow(beam(2), starts, AMPLITUDE, frequency, 5, steps_per_period=512)
    for lane, start in enumerate(starts):

        def rate(t: float, y: np.ndarray) -> list[float]:
            force = AMPLITUDE * np.cos(2 * np.pi * frequency * t)
            return [y[1], force - DAMPING * y[1] - STIFFNESS * y[0] - CUBIC * y[0] ** 3]

        oracle = solve_ivp(
            rate, (0, 5 / frequency), start, method="DOP853", rtol=1e-11, atol=1e-11,
            t_eval=np.arange(6) / frequency,
        )  # fmt: skip
        assert np.allclose(found.displacement[:, lane], oracle.y[0], rtol=0.0, atol=1e-4)
        assert np.allclose(found.velocity[:, lane], oracle.y[1], rtol=0.0, atol=1e-2)


def test_more_rows_a_period_are_the_same_motion_whatever_the_blocks() -> None:
    starts = np.array([[7.0, 0.0], [3.0, -100.0], [-6.0, 5.0]])
    coarse = follow(beam(3), starts, AMPLITUDE, 12.0, 70)
    fine = follow(beam(3), starts, AMPLITUDE, 12.0, 70, rows_per_period=32)
    assert np.array_equal(fine.displacement[::32], coarse.displacement)
    assert np.array_equal(fine.velocity[::32], coarse.velocity)
    assert np.array_equal(fine.displacement[0], starts[:, 0])


def test_a_sweep_gives_each_frequency_its_whole_periods_in_order_on_any_number_of_threads() -> None:
    starts = np.array([[7.0, 0.0], [-6.0, 5.0]])
    alone = list(sweep(beam(2), starts, AMPLITUDE, [8.0, 11.5], 2.0))
    both = list(sweep(beam(2), starts, AMPLITUDE, [8.0, 11.5], 2.0, threads=2))
    assert [len(one.displacement) for one in alone] == [17, 24]
    assert all(np.array_equal(a.displacement, b.displacement) for a, b in zip(alone, both, strict=True))


def test_what_goes_on_from_period_to_period_is_refused() -> None:
    with pytest.raises(ValueError, match="without memory"):
        follow(beam(1, "stiffness.viscoelastic"), np.zeros((1, 2)), 1.0, 10.0, 1)
    with pytest.raises(ValueError, match="do not divide"):
        follow(beam(1), np.zeros((1, 2)), 1.0, 10.0, 1, rows_per_period=7)
