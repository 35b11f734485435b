"""`drive.lag`: x with time_constant x' = u - x drives instead of u.

A record begins with x at `settled` times the drive's first value: 1 where that had been there for long, 0 where a bench
that was off is switched on with it. A device that is served (`streaming`) was off.
"""

from __future__ import annotations

from plant_sim.oscillator.integration.linear import lagging_nodes
from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values, coefficient, shape


def lagging(drive: Driven, p: Values) -> Driven:
    """Return the drive behind a first-order lag; exact for a parabola over each step."""
    if p["time_constant"] == 0.0:
        return drive
    return drive._replace(nodes=lagging_nodes(drive.nodes, drive.step_s / p["time_constant"], p["settled"]))


MECHANISM = OscillatorMechanism(
    id="drive.lag",
    statement="The drive lags with a time constant of {time_constant}.",
    parameters=(
        coefficient("time_constant", "s", "of the drive behind its samples", lambda s: 1.0 / s.rate, low=0.0),
        shape(
            "settled", "dimensionless", "share of the drive's first value that a record begins with", lambda s: 1.0,
            default=1.0, low=0.0, high=1.0, shape_range=(0.0, 1.0), also=(0.0,), redundant=True,
        ),
    ),
    drive=lagging,
    transfer=lambda s, p: 1.0 / (1.0 + p["time_constant"] * s),
    stage=6,
)  # fmt: skip
