"""A filter behind an output that has an input in it: the output bends and jumps where the input does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from equation_cases import simulation_of

from plant_sim.equations.system import directly_driven
from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus

PERIOD_S, LAG_S, SAMPLES = 1e-3, 2e-4, 300
DRIVE = np.random.default_rng(11).standard_normal(SAMPLES)
THROUGH = """
[model]
kind = "equations"
[model.inputs]
u = { unit = "V" }
[model.states]
x = { unit = "V", rate = "(u - x)/slow" }
[model.terms]
passed = { unit = "V", value = "u - x" }
[model.outputs]
y = { unit = "V", value = "passed" }
slow_part = { unit = "V", value = "x" }
[model.parameters]
slow = { value = 20.0, unit = "ms" }
"""
LAG = """
[[model.mechanisms]]
id = "output.y.lag"
parameters = { time_constant = { value = 0.2, unit = "ms" } }
"""


def lagging(hold: str) -> FloatArray:
    """By the same filters in steps of 1/200 sample, each exact for a line within one."""
    fine = 200
    step_s = PERIOD_S / fine
    found, x, y = [DRIVE[0]], 0.0, DRIVE[0]
    for before, after in zip(DRIVE[:-1], DRIVE[1:], strict=True):
        slope = (after - before) / fine if hold == "linear" else 0.0
        for k in range(fine):
            u, to = before + k * slope, before + (k + 1) * slope
            end = behind(x, u, to, step_s, 20e-3)
            y = behind(y, u - x, to - end, step_s, LAG_S)
            x = end
        found.append(y)
    return np.array(found)


def behind(y: float, begin: float, end: float, step_s: float, tau_s: float) -> float:
    decay = float(np.exp(-step_s / tau_s))
    share = tau_s / step_s * (1.0 - decay)
    return decay * y + (share - decay) * begin + (1.0 - share) * end


@pytest.mark.parametrize("hold", ["linear", "zero"])
def test_a_short_lag_of_an_input_that_passes_through_is_exact(hold: str, tmp_path: Path) -> None:
    """It was off by 24 % of its effect behind a held input."""
    stimulus = Stimulus(inputs={"u": DRIVE}, holds={"u": hold}, period_s=PERIOD_S)
    units = {"u": "V", "y": "V", "slow_part": "V"}
    read = {}
    for text in (THROUGH, THROUGH + LAG):
        simulation = simulation_of(tmp_path, text, units)
        values = np.array([[one.value for one in simulation.parameters]])
        read[text] = simulation.predict(stimulus, values, np.zeros((1, 1))).outputs["y"][0]
    expected = lagging(hold)
    assert directly_driven(simulation.system) == {"y"}
    effect = np.linalg.norm(read[THROUGH] - expected)
    assert np.linalg.norm(read[THROUGH + LAG] - expected) < 1e-3 * effect
