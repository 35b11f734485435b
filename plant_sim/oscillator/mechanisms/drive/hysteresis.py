"""`actuator.hysteresis`: u + H(u) drives instead of u, H a Prandtl-Ishlinskii operator (`integration.turning_points`).

What piezo stacks and magnetostrictive rods do with a voltage or a current at any frequency. A record begins as from
rest, but for its `remanence`, which earlier drives left: one turning point before the record, at most three times as
far as the record's own drive goes.
"""

from __future__ import annotations

import numpy as np

from plant_sim.oscillator.integration.turning_points import arrive, follow_turning_points
from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values, coefficient, shape

FARTHEST = 3.0
"""Times the largest drive of a record that a drive before it may have been."""


def hysteretic(drive: Driven, p: Values) -> Driven:
    """Return the drive behind the hysteresis."""
    density, fading = p["density"], p["fading"]
    if density == 0.0:
        return drive
    largest = FARTHEST * float(np.abs(drive.nodes).max())
    state = arrive(float(drive.nodes[0, 0]), p["remanence"], largest, density, fading)
    more = np.empty_like(drive.nodes)
    follow_turning_points(state, drive.nodes, density, fading, more)
    return drive._replace(nodes=drive.nodes + more)


MECHANISM = OscillatorMechanism(
    id="actuator.hysteresis",
    statement="The actuator is hysteretic (Prandtl and Ishlinskii): from rest a drive u acts as u + {density} u^2 / 2, "
    "and goes back on another path.",
    supplements={"fading": "Larger loops widen less: the density of its play operators falls with {fading}."},
    parameters=(
        coefficient("density", "1/({u})", "of play operators over their thresholds", lambda s: 1.0 / s.drive, low=0.0),
        coefficient(
            "remanence", "{u}", "that drives before the record left, beside what the first drive does from rest",
            lambda s: s.drive, default=0.0, per_record=True,
        ),
        shape(
            "fading", "1/({u})", "with which the density falls with the threshold; 0: it does not",
            lambda s: 1.0 / (s.largest_drive or 1.0), default=0.0, simplest=0.0, smooth=True, low=0.0,
            shape_range=(0.0, 10.0),
        ),
    ),
    drive=hysteretic,
    bends=True,
    stage=8,
)  # fmt: skip
