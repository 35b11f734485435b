"""`timing.skew`: the outputs of a row are those of `late` after its instant.

What is read early shows the response late: below 0 this is `drive.delay`, and no record tells one from the other.
"""

from plant_sim.oscillator.mechanism import OscillatorMechanism, Sampled, Values, coefficient


def read_late(drive: Sampled, p: Values) -> Sampled:
    """Return the drive so much earlier: rows are then at their readings' instants."""
    return drive._replace(delay_s=drive.delay_s - p["late"])


MECHANISM = OscillatorMechanism(
    id="timing.skew",
    statement="The outputs of a row are read {late} after the row's instant (below 0: before it).",
    parameters=(
        coefficient(
            "late", "s", "from the row's instant to the reading of its outputs", lambda s: 1.0 / s.rate,
            opposite="drive.delay",
        ),
    ),
    input=read_late,
    in_steady_state=False,
    stage=1,
)  # fmt: skip
