"""A beginning of a record: what is simulated of it is what is simulated of the whole one."""

from __future__ import annotations

import numpy as np
import pytest
from oscillator_cases import DUFFING, oscillator
from scipy.signal import butter, filtfilt
from vo2_model_cases import simulation

from rtctl.border.simulation import Simulation, Stimulus
from rtctl.identification.fit_record import FitRecord

SAMPLES, KEPT = 500, 217
SMOOTH = filtfilt(*butter(6, 0.4), np.random.default_rng(3).standard_normal(SAMPLES))
"""Next to nothing from half the sample rate on, as a drive that is said to be band-limited."""


def simulated(made: Simulation, stimulus: Stimulus) -> dict[str, np.ndarray]:
    """Of the first `KEPT` samples."""
    values = np.array([one.value for one in made.parameters])
    return {name: run[0, :KEPT] for name, run in made.predict(stimulus, values).outputs.items()}


@pytest.mark.parametrize("hold", ["linear", "zero", "band-limited"])
@pytest.mark.parametrize("plant", ["oscillator", "oscillator that is held otherwise", "vo2"])
def test_a_beginning_moves_as_the_whole_record_did(plant: str, hold: str) -> None:
    if plant == "vo2":
        made: Simulation = simulation()
        inputs, period_s = {"current": 6.0 + SMOOTH}, 1e-3
    else:
        made = oscillator(DUFFING)
        inputs, period_s = {"drive": SMOOTH}, 4e-3
        if plant != "oscillator":
            made = made.extended(("input.hold",))
            names = [one.name for one in made.parameters]
            values = np.array([one.value for one in made.parameters])
            values[names.index("input.hold.toward_band_limited")] = 1.0
            made = made.with_values(values)
    held = dict.fromkeys(inputs, hold)
    # the largest amplitudes of the whole, so that both are simulated by the same steps
    peak = {"displacement": 1.0}
    stimulus = Stimulus(inputs=inputs, holds=held, period_s=period_s, peak=peak)
    whole = FitRecord(name="r", stimulus=stimulus, measured={"reading": SMOOTH})
    part = whole.truncate(400).truncate(KEPT)
    assert part.samples == KEPT == len(part.measured["reading"])
    expected, found = simulated(made, whole.stimulus), simulated(made, part.stimulus)
    for name, run in expected.items():
        np.testing.assert_allclose(found[name], run, rtol=0.0, atol=2e-5 * np.ptp(run))
