"""Two laws that are one to first order: fits of the second start away from where its linear estimate says nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from diagnosis_cases import PERIOD_S, dataset_of, device, measured, problem_of

from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.proposals.candidates import propose_candidates

LAG_S = 0.2 * PERIOD_S


def burst(frequency_hz: float, level: float, samples: int = 1500) -> np.ndarray:
    """A tone near the resonance that ends in the middle of the record [V]."""
    time_s = PERIOD_S * np.arange(samples)
    return level * np.where(time_s < 0.5 * time_s[-1], np.sin(2.0 * np.pi * frequency_hz * time_s), 0.0)


def test_a_lag_starts_where_rows_that_are_read_later_make_room_for_it(tmp_path: Path) -> None:
    """Rows are read at the end of their period, behind a lag: together a skew of 0.8 periods."""
    plant = device(
        {"id": "timing.skew", "parameters": {"late": {"value": PERIOD_S, "unit": "s"}}},
        {"id": "sensor.lag", "parameters": {"time_constant": {"value": LAG_S, "unit": "s"}}},
        damping=(1.5, "1/s"),
    )
    drives = [burst(20.0, 6.0), burst(20.3, 9.0)]
    data = dataset_of(tmp_path, *((drive, measured(plant, drive), "fit") for drive in drives))
    problem = problem_of(data)
    skewed = fit_hypothesis(
        problem, device(damping=(1.5, "1/s")).extended(("timing.skew",)), ("timing.skew",)
    )
    assert skewed is not None
    parent = run_residual_tests(skewed, problem, ("timing.skew", "sensor.lag"))
    candidates = [
        one for one in propose_candidates(parent, problem.thresholds.search) if "sensor.lag" in one.mechanisms
    ]
    for one in candidates:
        start = {parameter.name: parameter.value for parameter in one.simulation.parameters}
        assert start["sensor.lag.time_constant"] > 0.05 * PERIOD_S
        assert start["timing.skew.late"] > 0.85 * PERIOD_S
        there = fit_hypothesis(problem, one.simulation, one.mechanisms, one.starts, 8)
        assert there is not None
        assert there.cost < 1.01 * skewed.cost, "in the valley"
    assert len(candidates) == len(problem.thresholds.search.valley_shares)
