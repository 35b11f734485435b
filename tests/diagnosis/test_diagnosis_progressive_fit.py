"""A record that crossed a barrier at another moment is followed again from its beginning."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, device, noise_drive

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.nominal_fit.progressive_fit import fit_progressively
from rtctl.diagnosis.nominal_fit.step_refinement import refine_nominal
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales
from rtctl.plants.oscillator.diagnosis import OSCILLATOR

WELLS = {"stiffness": (-1.6e3, "1/s^2"), "stiffness_cubic": (30.0, "1/(mm^2*s^2)"), "damping": (3.0, "1/s")}
"""At 7.3 mm either way; it rocks in one at 9 Hz."""
SAMPLES, NOISE_MM, WELL_MM = 1500, 0.02, 7.3
HOPPING = 2
"""The record that is driven over the barrier."""


@cache
def between_wells() -> Problem:
    """Two records within a well and one that hops."""
    plant = device(**WELLS)
    values = np.array([one.value for one in plant.parameters])
    records = []
    for seed, level in ((1, 1.0), (2, 1.0), (3, 4.0)):
        stimulus = Stimulus(
            inputs={"drive": noise_drive(seed, level, SAMPLES)}, holds={"drive": "linear"}, period_s=PERIOD_S,
            initial={"displacement": WELL_MM},
        )  # fmt: skip
        reading = plant.predict(stimulus, values, np.array([[WELL_MM, 0.0]])).outputs["displacement"][0]
        reading = reading + NOISE_MM * np.random.default_rng(seed).standard_normal(SAMPLES)
        records.append(
            FitRecord(name=f"r{seed}", stimulus=stimulus, measured={"displacement": reading}, first=1)
        )
    return Problem(
        subject=OSCILLATOR, records=tuple(records), scales=estimate_scales(records), steps_per_period=64.0
    )


def gone_astray(problem: Problem) -> Hypothesis:
    """Fitted from a stiffness that is a little off: it crosses at other moments, and ends there."""
    plant = device(**WELLS)
    values = np.array([one.value for one in plant.parameters])
    names = [one.name for one in plant.parameters]
    values[names.index("stiffness")] *= 1.05
    found = fit_hypothesis(problem, plant.with_values(values), ())
    assert found is not None
    return found


def noise_cost(problem: Problem) -> float:
    samples = sum(record.samples - record.first for record in problem.records)
    return 0.5 * samples * (NOISE_MM / problem.size("displacement")) ** 2


def test_a_record_that_is_lost_is_caught_up_with() -> None:
    problem = between_wells()
    astray = gone_astray(problem)
    assert astray.cost > 100.0 * noise_cost(problem)
    found = fit_progressively(problem, astray)
    assert found.cost == pytest.approx(noise_cost(problem), rel=0.1)
    assert fit_progressively(problem, found) is found  # none stands out any more


def test_what_cannot_be_followed_is_left_as_it_is() -> None:
    problem = between_wells()
    noise = {"displacement": np.random.default_rng(0).standard_normal(SAMPLES)}
    deaf = (*problem.records[:HOPPING], replace(problem.records[HOPPING], measured=noise))
    strange = replace(problem, records=deaf)
    nominal = fit_hypothesis(strange, device(**WELLS), ())
    assert nominal is not None
    assert fit_progressively(strange, nominal).cost == pytest.approx(nominal.cost, rel=0.05)
    alone = replace(problem, records=problem.records[HOPPING:])
    one = fit_hypothesis(alone, device(**WELLS), ())
    assert one is not None
    assert fit_progressively(alone, one) is one


def test_a_diagnosis_begins_with_every_record_followed() -> None:
    problem = between_wells()
    _, nominal = refine_nominal(problem, gone_astray(problem))
    assert nominal.cost == pytest.approx(noise_cost(problem), rel=0.1)
