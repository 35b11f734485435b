"""`drive.lag`: x with time_constant x' = u - x drives instead of u."""

from __future__ import annotations

from plant_sim.oscillator.linear import lagging_nodes
from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values, coefficient


def lagging(drive: Driven, p: Values) -> Driven:
    """A first-order follower of the drive, settled on its first value; exact for a parabola over each step."""
    if p["time_constant"] == 0.0:
        return drive
    return drive._replace(nodes=lagging_nodes(drive.nodes, drive.step_s / p["time_constant"]))


MECHANISM = OscillatorMechanism(
    id="drive.lag",
    statement="The drive lags with a time constant of {time_constant}.",
    parameters=(
        coefficient("time_constant", "s", "of the drive behind its samples", lambda s: 1.0 / s.rate, low=0.0),
    ),
    drive=lagging,
    stage=6,
)
