"""`drive.harmonics`: u + second u^2 + third u^3."""

from __future__ import annotations

from plant_sim.oscillator.integration.pointwise import pointwise
from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values, coefficient

PURE = 100.0
"""Times as far as usual is each term searched: nothing of an electrostatic force, a square, is linear."""


def distorted(drive: Driven, p: Values) -> Driven:
    """Return the drive with its square and cube."""
    return pointwise(drive, lambda u: u + u * u * (p["second"] + p["third"] * u))


MECHANISM = OscillatorMechanism(
    id="drive.harmonics",
    statement="The drive is distorted: {second} of its square and {third} of its cube are added.",
    parameters=(
        coefficient("second", "1/({u})", "of u^2", lambda s: 1.0 / s.drive, default=0.0, reach=PURE),
        coefficient("third", "1/({u})^2", "of u^3", lambda s: 1.0 / s.drive**2, default=0.0, reach=PURE),
    ),
    drive=distorted,
    bends=True,
    stage=5,
)
