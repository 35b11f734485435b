"""`input.gain_drift`: u (1 + rate d (1 - exp(-t / d))), t from the record's first sample.

d is the settling time; without one it is u (1 + rate t).
"""

from __future__ import annotations

import numpy as np

from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values, coefficient
from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import FIRST_RATE, drift_of, settling_time


def drifting(drive: Driven, p: Values) -> Driven:
    """Return the drive of an amplifier whose gain changes."""
    return drive._replace(nodes=amplified(drive.nodes, p["rate"], p["settling_time"], 0.0, drive.step_s))


def amplified(nodes: FloatArray, rate: float, settling_s: float, start_s: float, step_s: float) -> FloatArray:
    """Return `nodes` (steps, 3) at the gain of their time, of steps of `step_s` [s] from t = `start_s` [s] on."""
    time_s = start_s + step_s * (np.arange(len(nodes))[:, None] + np.array([0.0, 0.5, 1.0]))
    found: FloatArray = nodes * (1.0 + rate * drift_of(time_s, settling_s))
    return found


MECHANISM = OscillatorMechanism(
    id="input.gain_drift",
    statement="The gain of the drive drifts by {rate} of itself from the start of each record.",
    forms={
        "settling_time": "The gain of the drive drifts by {rate} of itself at the start of each record and settles "
        "with a time constant of {settling_time}."
    },
    parameters=(
        coefficient(
            "rate", "1/s", "relative, of the drive's gain", lambda s: 1.0 / s.duration, reach=FIRST_RATE
        ),
        settling_time(),
    ),
    in_steady_state=False,
    drive=drifting,
    stage=1,
    slow=True,
)
