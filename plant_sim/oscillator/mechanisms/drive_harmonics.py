"""`drive.harmonics`: u + second u^2 + third u^3."""

from __future__ import annotations

from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values, coefficient


def distorted(drive: Driven, p: Values) -> Driven:
    """The drive with its square and cube."""
    u = drive.nodes
    return drive._replace(nodes=u + p["second"] * u**2 + p["third"] * u**3)


MECHANISM = OscillatorMechanism(
    id="drive.harmonics",
    statement="The drive is distorted: {second} of its square and {third} of its cube are added.",
    parameters=(
        coefficient("second", "1/({u})", "of u^2", lambda s: 1.0 / s.drive),
        coefficient("third", "1/({u})^2", "of u^3", lambda s: 1.0 / s.drive**2),
    ),
    drive=distorted,
    stage=5,
)
