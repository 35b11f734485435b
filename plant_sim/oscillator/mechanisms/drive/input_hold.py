"""`input.hold`: between its samples the drive goes on otherwise than the manifest says.

Its forms are the holds that there are: two of them together are no hold, but an imitation of samples that are early.
"""

from __future__ import annotations

from plant_sim.oscillator.mechanism import OscillatorMechanism, Sampled, Values, coefficient

HOLDS = {"toward_zero": "zero", "toward_linear": "linear", "toward_band_limited": "band-limited"}
NAMES = {"toward_zero": "held", "toward_linear": "linear", "toward_band_limited": "band-limited"}


def held(drive: Sampled, p: Values) -> Sampled:
    """Return u + sum of weight (u held otherwise - u held as declared)."""
    others = tuple(
        (HOLDS[name], weight) for name, weight in p.items() if weight and HOLDS[name] != drive.hold
    )
    return drive._replace(blend=drive.blend + others)


MECHANISM = OscillatorMechanism(
    id="input.hold",
    statement=(
        "Between its samples the drive is not what the manifest says: {toward_zero} of the difference is towards held, "
        "{toward_linear} towards linear, {toward_band_limited} towards band-limited."
    ),
    forms={
        name: f"Between its samples the drive is not what the manifest says, but {hold}: {{{name}}} of the difference."
        for name, hold in NAMES.items()
    },
    parameters=tuple(
        coefficient(
            name,
            "dimensionless",
            f"share of what the hold {hold} differs by",
            lambda s: 1.0,
            low=0.0,
            high=1.0,
            default=0.0,
        )
        for name, hold in HOLDS.items()
    ),
    in_steady_state=False,
    input=held,
    stage=0,
)
