"""`input.hold`: between its samples the drive goes on otherwise than the manifest says.

Its forms are the holds that there are: two of them together are no hold, but an imitation of samples that are early.
"""

from __future__ import annotations

from plant_sim.oscillator.mechanism import OscillatorMechanism, Sampled, Values, coefficient

HOLDS = {"toward_zero": "zero", "toward_linear": "linear", "toward_band_limited": "band-limited"}


def held(drive: Sampled, p: Values) -> Sampled:
    """Return u + sum of weight (u held otherwise - u held as declared)."""
    others = tuple(
        (HOLDS[name], weight) for name, weight in p.items() if weight and HOLDS[name] != drive.hold
    )
    return drive._replace(blend=drive.blend + others)


def remedy(name: str, signal: str) -> str:
    """Return what to write in the manifest for the parameter `name`, as a template of its share."""
    scale = f"the data lie {{{name}}} of the way from the manifest's hold to this one"
    return f'Write hold = "{HOLDS[name]}" in its [signals.{signal}]: {scale}.'


MECHANISM = OscillatorMechanism(
    id="input.hold",
    statement=(
        "Between its samples the drive does not go on as the hold in the manifest says: a share of {toward_zero} goes "
        'on as hold = "zero" says, {toward_linear} as "linear", {toward_band_limited} as "band-limited".'
    ),
    forms={
        name: "Between its samples the drive does not go on as the hold in the manifest says. "
        + remedy(name, "drive")
        for name in HOLDS
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
