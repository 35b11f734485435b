"""A filter behind an accelerometer: the drive bends the acceleration at each sample, and a held one lets it jump."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from plant_sim.oscillator.kinks import kinks_of
from plant_sim.oscillator.model import oscillator_simulation
from rtctl.border.arrays import FloatArray
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Stimulus

PERIOD_S, SAMPLES, FINE = 1.0 / 5120.0, 400, 256
STIFFNESS, DAMPING = 2.4e6, 47.0
DRIVE = np.random.default_rng(7).standard_normal(SAMPLES) * (np.arange(SAMPLES) > 0)
LAG_S = 36e-6


def read(hold: str, *mechanisms: tuple[str, str, float, str], after: bool = False) -> FloatArray:
    parameters = {
        "damping": {"value": DAMPING, "unit": "1/s"}, "stiffness": {"value": STIFFNESS, "unit": "1/s^2"},
        "drive_gain": {"value": 1.0, "unit": "mm/(s^2*N)"},
    }  # fmt: skip
    tables = [
        {"id": one, "parameters": {key: {"value": value, "unit": unit}}}
        for one, key, value, unit in mechanisms
    ]
    model = ModelFile.model_validate(
        {"model": {"kind": "oscillator", "parameters": parameters, "mechanisms": tables}}
    )
    simulation = oscillator_simulation(model, {"drive": "N", "acceleration": "mm/s^2"}, "test")
    stimulus = Stimulus(
        inputs={"drive": DRIVE}, holds={"drive": hold}, period_s=PERIOD_S,
        after_jumps=frozenset({"acceleration"} if after else ()),
    )  # fmt: skip
    values = np.array([[one.value for one in simulation.parameters]])
    return simulation.predict(stimulus, values, np.zeros((1, 2))).outputs["acceleration"][0]


def lagging(hold: str) -> FloatArray:
    """By the exact solution in fine steps, and a lag that is exact for a line within each."""
    step = PERIOD_S / FINE
    matrix = np.zeros((4, 4))
    matrix[0, 1] = matrix[1, 2] = matrix[2, 3] = 1.0
    matrix[1, :2] = -STIFFNESS, -DAMPING
    onward, decay = expm(matrix * step), np.exp(-step / LAG_S)
    share = LAG_S / step * (1.0 - decay)
    state, y, found = np.zeros(2), 0.0, [0.0]
    for k in range(SAMPLES - 1):
        rate = (DRIVE[k + 1] - DRIVE[k]) / PERIOD_S if hold == "linear" else 0.0
        drive = DRIVE[k]
        for _ in range(FINE):
            begin = drive - STIFFNESS * state[0] - DAMPING * state[1]
            state = (onward @ np.array([*state, drive, rate]))[:2]
            drive += rate * step
            end = drive - STIFFNESS * state[0] - DAMPING * state[1]
            y = decay * y + (share - decay) * begin + (1.0 - share) * end
        found.append(y)
    return np.array(found)


@pytest.mark.parametrize("after", [False, True], ids=["read before a jump", "read after it"])
@pytest.mark.parametrize("hold", ["linear", "zero"])
def test_a_short_lag_of_an_accelerometer_is_exact(hold: str, after: bool) -> None:
    """It was off by 7 % of its effect between straight lines, and by 38 % behind a held drive."""
    lag = ("sensor.lag", "time_constant", LAG_S, "s")
    expected, found = lagging(hold), read(hold, lag, after=after)
    effect = np.linalg.norm(read(hold, after=False) - expected)
    assert np.linalg.norm(found - expected)[()] < 1e-3 * effect


def test_a_jump_within_a_sample_is_none_at_it() -> None:
    """A held drive that is half a sample late jumps between samples, where nothing is taken for a jump."""
    at_samples = np.repeat(np.arange(6.0), 4)[:, None] * np.ones(3)
    late = np.roll(at_samples, 2, axis=0)
    assert kinks_of(at_samples[:, 0], at_samples[:, 2], 4, 4, after=False).jumps
    assert not kinks_of(late[:, 0], late[:, 2], 4, 4, after=False).jumps
