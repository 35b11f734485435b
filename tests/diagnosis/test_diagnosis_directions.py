"""Slopes of a mechanism take the steps that its shapes need, whatever unit the data are in."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, measured, noise_drive

from plant_sim.oscillator.motion import Equation
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.problem.finite_differences import differentiate
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.residual.directions import catalogue_directions, mechanism_sensitivities
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales
from rtctl.wiring_models import build_simulation


def in_micrometres() -> tuple[Problem, Hypothesis]:
    """A device that moves by thousands of them."""
    parameters = {
        "damping": {"value": 8.0, "unit": "1/s"}, "stiffness": {"value": 1.6e4, "unit": "1/s^2"},
        "drive_gain": {"value": 4.5e6, "unit": "um/s^2/V"},
    }  # fmt: skip
    model = ModelFile.model_validate({"model": {"kind": "oscillator", "parameters": parameters}})
    device = build_simulation(model, {"drive": "V", "displacement": "um"}, "device")
    drive = noise_drive(1)
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
    reading = measured(device, drive, noise=1.0)
    records = (FitRecord(name="r", stimulus=stimulus, measured={"displacement": reading}),)
    problem = Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )
    nominal = fit_hypothesis(problem, device, (), iterations=3)
    assert nominal is not None
    assert problem.size("displacement") > 1000.0
    return problem, nominal


def test_a_shape_that_does_not_act_yet_asks_for_no_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hysteresis that yields over one unit would be a relay here."""
    problem, nominal = in_micrometres()
    taken = []

    def noted(self: Equation, drive: Any, how: Any, *more: Any) -> Any:
        taken.append(how.substeps)
        return integrate(self, drive, how, *more)

    integrate = Equation.integrate
    monkeypatch.setattr(Equation, "integrate", noted)
    residual = [np.zeros((1, problem.records[0].samples))]
    directions = catalogue_directions(nominal.simulation, ("hysteresis.bouc_wen",), problem, residual)
    slopes = mechanism_sensitivities(nominal, directions, problem, 0)
    assert (np.abs(slopes).max(axis=(1, 2)) > 0.0).all()
    assert max(taken) < 100


def test_a_direction_that_no_step_resolves_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, nominal = in_micrometres()

    def refused(*of: object) -> object:
        raise ValueError("would need 1e9 steps")

    residual = [np.zeros((1, problem.records[0].samples))]
    directions = catalogue_directions(nominal.simulation, ("hysteresis.bouc_wen",), problem, residual)
    monkeypatch.setattr(type(nominal.simulation), "predict", refused)
    assert not mechanism_sensitivities(nominal, directions, problem, 0).any()


def test_a_step_that_moves_the_motion_far_is_taken_again_shorter() -> None:
    """Near a barrier the bend of a slope would look like a direction of its own."""
    problem, _ = in_micrometres()
    size, along = problem.size("displacement"), np.ones((1, problem.records[0].samples))

    def bent(step: float) -> np.ndarray:
        return size * along * (3e4 * step + 1e10 * step**2)

    found = differentiate(bent, problem, ["displacement"])
    assert np.all(np.abs(found / size / 3e4 - 1.0) < 0.001)

    def escaping(step: float) -> np.ndarray:
        return size * along * (1e10 * step)

    assert differentiate(escaping, problem, ["displacement"]) == 0.0
