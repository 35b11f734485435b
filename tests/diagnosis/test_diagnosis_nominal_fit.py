"""A softening spring that is a little off runs away from a record; a diagnosis begins all the same, and says how."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, device, noise_drive

from rtctl.border.errors import RunError
from rtctl.border.simulation import Simulation, Stimulus
from rtctl.diagnosis.nominal_fit.nominal_fit import DIVERGES, _fit_before_divergence, fit_nominal
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales
from rtctl.plants.oscillator.diagnosis import OSCILLATOR

SOFTENING = {"stiffness_cubic": (-430.0, "1/(mm^2*s^2)")}
"""Beyond 6.1 mm it pushes away."""
NOISE_MM, SAMPLES = 0.004, 1500


@cache
def near_the_edge() -> Problem:
    plant = device(**SOFTENING)
    values = np.array([one.value for one in plant.parameters])
    records = []
    for seed, level in ((1, 2.0), (2, 12.5)):
        stimulus = Stimulus(
            inputs={"drive": noise_drive(seed, level, SAMPLES)}, holds={"drive": "linear"}, period_s=PERIOD_S
        )
        reading = plant.predict(stimulus, values, np.zeros((1, 2))).outputs["displacement"][0]
        reading = reading + NOISE_MM * np.random.default_rng(seed).standard_normal(SAMPLES)
        records.append(FitRecord(name=f"r{seed}", stimulus=stimulus, measured={"displacement": reading}))
    return Problem(
        subject=OSCILLATOR, records=tuple(records), scales=estimate_scales(records), steps_per_period=64.0
    )


def off_by(share: float) -> Simulation:
    """The device's model with a stronger drive."""
    plant = device(**SOFTENING)
    values = [one.value * (1.0 + share if one.name == "drive_gain" else 1.0) for one in plant.parameters]
    return plant.with_values(np.array(values))


def test_a_model_that_runs_away_from_a_record_is_fitted_to_what_comes_before_and_then_to_all() -> None:
    problem = near_the_edge()
    assert fit_hypothesis(problem, off_by(0.05), ()) is None
    whole, nominal = _fit_before_divergence(problem, off_by(0.05), ())
    assert [record.samples for record in whole.records] == [SAMPLES, SAMPLES]
    noise = 0.5 * 2 * SAMPLES * (NOISE_MM / problem.size("displacement")) ** 2
    assert nominal.cost == pytest.approx(noise, rel=0.1)
    first = fit_nominal(problem, off_by(0.05), lambda text: None)
    assert first.uncut
    assert not first.notes
    assert first.nominal.cost == pytest.approx(noise, rel=0.1)


def test_a_model_that_follows_next_to_nothing_is_refused() -> None:
    problem = near_the_edge()
    loud = {"displacement": 50.0 * np.random.default_rng(0).standard_normal(SAMPLES)}
    deaf = replace(problem, records=tuple(replace(one, measured=loud) for one in problem.records))
    with pytest.raises(RunError, match=DIVERGES):
        _fit_before_divergence(deaf, off_by(0.0), ())
