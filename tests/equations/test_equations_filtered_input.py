"""A filter behind an output that has an input in it: the output bends and jumps where the input does."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from equation_cases import simulation_of

from plant_sim.equations.system import directly_driven
from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.experiment_design.t_optimality import find_rest_state

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


@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_a_lag_before_a_first_order_device_and_one_behind_it_are_one_law(hold: str, tmp_path: Path) -> None:
    """Its reading bends where a held input jumps: by 1.5e-4 of its swing they differed, and an experiment was proposed
    that was to tell them apart."""
    drive = np.concatenate(([0.0], np.repeat(np.random.default_rng(3).uniform(0.0, 1.0, 30), 10)))
    stimulus = Stimulus(inputs={"u": drive}, holds={"u": hold}, period_s=5e-3)
    found = []
    for identity in ("input.u.lag", "output.slow_part.lag"):
        text = THROUGH + LAG.replace("output.y.lag", identity).replace("0.2", "15.0")
        simulation = simulation_of(tmp_path, text, {"u": "V", "slow_part": "V"})
        values = np.array([one.value for one in simulation.parameters])
        found.append(simulation.predict(stimulus, values).outputs["slow_part"][0])
    assert np.ptp(found[0]) > 0.3
    assert np.abs(found[0] - found[1]).max() < 2e-5 * np.ptp(found[0])


def test_an_experiment_begins_where_the_device_rests_and_not_at_zero_kelvin(tmp_path: Path) -> None:
    text = THROUGH.replace(
        'unit = "V", rate = "(u - x)/slow"', 'unit = "V", rate = "(u - x)/slow", initial = 2.5'
    )
    simulation = simulation_of(tmp_path, text, {"u": "V", "slow_part": "V"})
    candidate = SimpleNamespace(simulation=simulation, states=1)
    assert find_rest_state(candidate).tolist() == [2.5]
