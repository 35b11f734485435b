"""`actuator.backlash`: w = clip(w, u - width, u + width) drives instead of u (a play operator).

A record begins with the play in its middle, as far as the first value of the drive lets it be: w = clip(0, ...).
"""

from __future__ import annotations

import numpy as np

from plant_sim.oscillator.integration.play import follow_play
from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values, coefficient


def loose(drive: Driven, p: Values) -> Driven:
    """Return the drive behind the play."""
    behind = np.empty_like(drive.nodes)
    follow_play(np.zeros(1), drive.nodes, p["width"], behind)
    return drive._replace(nodes=behind)


MECHANISM = OscillatorMechanism(
    id="actuator.backlash",
    statement="The actuator has backlash: after each reversal the drive does nothing until it has gone back by twice "
    "{width}.",
    parameters=(
        coefficient("width", "{u}", "half of the play", lambda s: s.drive, low=0.0),
    ),
    drive=loose,
    bends=True,
    stage=7,
)  # fmt: skip
