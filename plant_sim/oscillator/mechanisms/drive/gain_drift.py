"""`input.gain_drift`: u (1 + rate t), t from the record's first sample."""

from __future__ import annotations

import numpy as np

from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values, coefficient
from rtctl.border.arrays import FloatArray


def drifting(drive: Driven, p: Values) -> Driven:
    """Return the drive of an amplifier whose gain changes evenly."""
    return drive._replace(nodes=amplified(drive.nodes, p["rate"], 0.0, drive.step_s))


def amplified(nodes: FloatArray, rate: float, start_s: float, step_s: float) -> FloatArray:
    """Return `nodes` (steps, 3) at the gain 1 + `rate` t, of steps of `step_s` [s] from t = `start_s` [s] on."""
    time_s = start_s + step_s * (np.arange(len(nodes))[:, None] + np.array([0.0, 0.5, 1.0]))
    found: FloatArray = nodes * (1.0 + rate * time_s)
    return found


MECHANISM = OscillatorMechanism(
    id="input.gain_drift",
    statement="The gain of the drive drifts by {rate} of itself from the start of each record.",
    parameters=(coefficient("rate", "1/s", "relative, of the drive's gain", lambda s: 1.0 / s.duration),),
    in_steady_state=False,
    drive=drifting,
    stage=1,
    slow=True,
)
