"""`drive.deadband`: no drive within +-width, less by width beyond."""

from __future__ import annotations

import numpy as np

from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values, coefficient


def dead(drive: Driven, p: Values) -> Driven:
    """sign(u) max(|u| - width, 0)."""
    u = drive.nodes
    return drive._replace(nodes=u - np.clip(u, -p["width"], p["width"]))


MECHANISM = OscillatorMechanism(
    id="drive.deadband",
    statement="Drives within {width} of zero do nothing.",
    parameters=(coefficient("width", "{u}", "half of the band", lambda s: s.drive, low=0.0),),
    drive=dead,
    stage=3,
)
