"""`drive.deadband`: sign(u) max(|u| - width, 0)."""

from __future__ import annotations

import numpy as np

from plant_sim.oscillator.integration.pointwise import pointwise
from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values, coefficient


def dead(drive: Driven, p: Values) -> Driven:
    """Return no drive within +-width, and less by width beyond."""
    return pointwise(drive, lambda u: u - np.clip(u, -p["width"], p["width"]))


MECHANISM = OscillatorMechanism(
    id="drive.deadband",
    statement="The first {width} of the drive, of either sign, do nothing.",
    parameters=(coefficient("width", "{u}", "half of the dead band", lambda s: s.drive, low=0.0),),
    drive=dead,
    bends=True,
    stage=3,
)
