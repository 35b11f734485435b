"""A model that would need absurdly many steps is refused before it fills the memory."""

from __future__ import annotations

import numpy as np
import pytest

from plant_sim.oscillator.model import oscillator_simulation
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
