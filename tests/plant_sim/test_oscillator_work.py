"""A model that would need absurdly many steps is refused before it fills the memory; none takes more than it needs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.motion import Equation
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Stimulus


def test_steps_are_counted_over_the_whole_record_before_they_are_taken() -> None:
    tables = {"model": {"kind": "oscillator", "parameters": {"stiffness": {"value": 1e13, "unit": "1/s^2"}}}}
    simulation = oscillator_simulation(
        ModelFile.model_validate(tables), {"displacement": "mm", "drive": "V"}, "model.toml"
    )
    stimulus = Stimulus(
        inputs={"drive": np.ones(200_000)}, holds={"drive": "zero"}, period_s=1e-5, peak={"displacement": 1.0}
    )
    values = np.array([parameter.value for parameter in simulation.parameters])
    with pytest.raises(ValueError, match=r"200000 samples of .* steps each"):
        simulation.predict(stimulus, values, steps_per_period=64.0)


def test_hysteresis_in_one_of_two_wells_is_resolved_at_the_speed_of_the_motion_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A swing of a tenth about a well at 1 is a tenth as fast as one from well to well."""
    hysteresis = {
        "id": "hysteresis.bouc_wen",
        "parameters": {
            "level": {"value": 10.0, "unit": "mm/s^2"}, "displacement": {"value": 0.005, "unit": "mm"},
            "loop": {"value": 0.5, "unit": "dimensionless"}, "bend": {"value": 0.5, "unit": "dimensionless"},
        },
    }  # fmt: skip
    parameters = {
        "damping": {"value": 5.0, "unit": "1/s"}, "stiffness": {"value": -1e4, "unit": "1/s^2"},
        "drive_gain": {"value": 500.0, "unit": "mm/s^2/V"}, "stiffness_cubic": {"value": 1e4, "unit": "1/(mm^2*s^2)"},
    }  # fmt: skip
    tables = {"model": {"kind": "oscillator", "parameters": parameters, "mechanisms": [hysteresis]}}
    simulation = oscillator_simulation(
        ModelFile.model_validate(tables), {"displacement": "mm", "drive": "V"}, "model.toml"
    )
    values = np.array([parameter.value for parameter in simulation.parameters])
    drive = 0.2 * np.sin(2.0 * np.pi * 22.0 * 1e-3 * np.arange(1500))
    whole = Stimulus(
        inputs={"drive": drive}, holds={"drive": "linear"}, period_s=1e-3, initial={"displacement": 1.0},
        peak={"displacement": 1.1},
    )  # fmt: skip
    taken = []

    def noted(self: Equation, *of: object) -> object:
        taken.append(of[1].substeps)  # type: ignore[attr-defined]
        return integrate(self, *of)  # type: ignore[arg-type]

    integrate = Equation.integrate
    monkeypatch.setattr(Equation, "integrate", noted)
    runs = [
        simulation.predict(stimulus, values).outputs["displacement"][0]
        for stimulus in (whole, replace(whole, swing={"displacement": 0.15}))
    ]
    assert np.ptp(runs[0]) == pytest.approx(0.2, rel=0.5)
    assert taken[1] < 0.25 * taken[0]
    np.testing.assert_allclose(runs[1], runs[0], atol=1e-4 * np.ptp(runs[0]))
