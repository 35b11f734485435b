"""Where dry friction stops a motion, a fit of its level has many valleys: the deepest is found from any of them."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis_cases import FRICTION, NOISE_MM, PERIOD_S, SAMPLES, device

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.nominal_fit.basin_search import search_basins
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales

LEVEL = 450.0


def ring_downs() -> Problem:
    """Of a device with friction that come to rest, each off its middle."""
    plant, records = device(FRICTION), []
    values = np.array([parameter.value for parameter in plant.parameters])
    for k, start in enumerate((3.0, -2.0, 1.1)):
        stimulus = Stimulus(
            inputs={"drive": np.zeros(SAMPLES)}, holds={"drive": "linear"}, period_s=PERIOD_S,
            initial={"displacement": start},
        )  # fmt: skip
        run = plant.predict(stimulus, values, np.array([[start, 0.0]])).outputs["displacement"][0]
        reading = run + NOISE_MM * np.random.default_rng(k).standard_normal(SAMPLES)
        records.append(FitRecord(name=f"r{k}", stimulus=stimulus, measured={"displacement": reading}))
    return Problem(
        subject=subject_of("oscillator"),
        records=tuple(records),
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )


def begun(problem: Problem, factor: float) -> Hypothesis:
    """From `factor` times the level."""
    plant = device(FRICTION)
    values = [p.value * (factor if p.mechanism else 1.0) for p in plant.parameters]
    found = fit_hypothesis(problem, plant.with_values(np.array(values)), ("friction.coulomb",))
    assert found is not None
    return found


@pytest.mark.parametrize("factor", [0.75, 0.85, 1.2])
def test_the_deepest_valley_is_found_from_its_neighbours(factor: float) -> None:
    problem = ring_downs()
    stuck, right = begun(problem, factor), begun(problem, 1.0)
    found = search_basins(problem, stuck)
    assert stuck.cost > 5.0 * right.cost
    assert found.cost < 1.05 * right.cost
    level = next(one.value for one in found.simulation.parameters if one.name == "friction.coulomb.level")
    assert level == pytest.approx(LEVEL, rel=1e-2)
