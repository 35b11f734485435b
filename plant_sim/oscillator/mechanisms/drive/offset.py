"""`drive.offset`: u + offset."""

from __future__ import annotations

from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values, coefficient
from plant_sim.oscillator.mechanisms.stiffness.another_zero import alike_about_another_zero


def shifted(drive: Driven, p: Values) -> Driven:
    """Return the drive with its zero off by `offset`."""
    return drive._replace(nodes=drive.nodes + p["offset"])


MECHANISM = OscillatorMechanism(
    id="drive.offset",
    statement="The drive has a constant part of {offset} that its samples do not show.",
    parameters=(coefficient("offset", "{u}", "added to the drive", lambda s: s.drive),),
    in_steady_state=False,
    drive=shifted,
    stage=2,
    about_another_zero=alike_about_another_zero("stiffness.quadratic"),
)
