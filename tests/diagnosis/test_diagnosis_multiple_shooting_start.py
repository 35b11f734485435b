"""The nominal fit takes steps that are not the error; the gate takes off what little they leave."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, device, measured, noise_drive

from rtctl.border.simulation import Simulation, Stimulus
from rtctl.diagnosis.nominal_fit.step_refinement import refine_nominal
from rtctl.diagnosis.nominal_fit.whole_record_start import fit_from_starts
from rtctl.diagnosis.problem.bounds import parameter_bounds
from rtctl.diagnosis.problem.fit import fit_hypothesis, sensitivity_of
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.testing.analysis import fine_step_residual
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales
from rtctl.plants.oscillator.diagnosis import OSCILLATOR


def data_of(
    plant: Simulation, start: tuple[float, float], noise: float, steps: float, level: float
) -> Problem:
    """Two records of 1500 samples of `plant`."""
    values = np.array([parameter.value for parameter in plant.parameters])
    records = []
    for seed in (1, 2):
        stimulus = Stimulus(
            inputs={"drive": noise_drive(seed, level)},
            holds={"drive": "linear"},
            period_s=PERIOD_S,
            initial={"displacement": start[0]},
        )
        reading = plant.predict(stimulus, values, np.array([start])).outputs["displacement"][0]
        reading = reading + noise * np.random.default_rng(seed).standard_normal(len(reading))
        records.append(FitRecord(name=f"r{seed}", stimulus=stimulus, measured={"displacement": reading}))
    return Problem(
        subject=OSCILLATOR, records=tuple(records), scales=estimate_scales(records), steps_per_period=steps
    )


def floor(problem: Problem, noise: float) -> float:
    """Half the sum of squares that noise leaves, on the scale of the cost."""
    samples = sum(record.samples for record in problem.records)
    return 0.5 * samples * (noise / problem.size("displacement")) ** 2


def test_steps_are_refined_where_they_leave_more_than_the_noise() -> None:
    noise, plant = 1e-6, device()
    problem = data_of(plant, (0.0, 0.0), noise, 12.0, 6.0)
    nominal = fit_from_starts(problem, plant, ())
    assert nominal is not None
    assert nominal.cost > 2.0 * floor(problem, noise)
    refined, nominal = refine_nominal(problem, nominal)
    assert refined.steps_per_period != 12.0
    assert nominal.cost < 1.1 * floor(problem, noise)


def test_steps_stay_where_the_noise_is_far_above_their_error() -> None:
    problem = data_of(device(), (0.0, 0.0), 0.004, 64.0, 6.0)
    nominal = fit_from_starts(problem, device(), ())
    assert nominal is not None
    assert refine_nominal(problem, nominal) == (problem, nominal)


def test_the_gate_takes_the_error_of_the_steps_off_the_residual() -> None:
    noise = 5e-3
    problem = data_of(device(), (0.0, 0.0), noise, 20.0, 6.0)
    at = fit_hypothesis(problem, device(), (), np.zeros((2, 2)), iterations=0)
    assert at is not None
    own_noise = noise * np.random.default_rng(1).standard_normal((1, problem.records[0].samples))
    coarse = at.linearise(problem)[0].residual
    error = np.std(coarse + own_noise)
    assert 1e-8 < error < 0.2 * noise
    assert np.std(fine_step_residual(at, problem, 0, coarse) + own_noise) < 0.01 * error


def test_a_nominal_value_is_not_looked_for_where_a_motion_would_need_steps_without_number() -> None:
    """A stretch of noise alone fits a spring of any strength; each length of stretches would go further."""
    problem = data_of(device(), (0.0, 0.0), 1e-3, 64.0, 6.0)
    limits = problem.thresholds.problem
    for own, most in ((1.0, limits.nominal_range), (1e9, None)):
        sensitivity = sensitivity_of(problem, device(stiffness_cubic=(own, "1/(mm^2*s^2)")), frozenset())
        low, high = parameter_bounds(problem, sensitivity)
        k = [sensitivity.simulation.parameters[i].name for i in sensitivity.free].index("stiffness_cubic")
        limit = most or limits.start_range * own / sensitivity.scale[k]  # where a model begins there is room
        assert high[k] == pytest.approx(limit)
        assert low[k] == pytest.approx(-limit)


@pytest.mark.slow
def test_a_constant_of_many_times_the_motion_leaves_the_nominal_values_as_they_are() -> None:
    """A fit without it would be of another motion, about that place."""
    plant, records = device(), []
    for seed in (1, 2):
        drive = noise_drive(seed)
        reading = measured(plant, drive) + 5.0
        stimulus = Stimulus(
            inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S,
            initial={"displacement": float(reading[0])}, read=frozenset({"displacement"}),
        )  # fmt: skip
        records.append(FitRecord(name="r", stimulus=stimulus, measured={"displacement": reading}, first=1))
    problem = Problem(
        subject=OSCILLATOR, records=tuple(records), scales=estimate_scales(records), steps_per_period=64.0
    )
    start = device(stiffness=(1.55e4, "1/s^2"), stiffness_cubic=(30.0, "1/(mm^2*s^2)"))
    nominal = fit_from_starts(problem, start, ())
    assert nominal is not None
    values = {one.name: one.value for one in nominal.simulation.parameters}
    assert values["stiffness"] == pytest.approx(1.6e4, rel=5e-3)
    assert values["drive_gain"] == pytest.approx(450.0, rel=5e-3)
