"""`friction.coulomb`: - level sign z', with stiction as strong, or - level tanh(z' / transition_speed) without."""

from __future__ import annotations

from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.equation.elementary import soft_sign
from plant_sim.oscillator.mechanism import Memory, OscillatorMechanism, Values, coefficient, shape


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def smoothed(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: level, 1 / transition speed; w: one state, which a law must have and none needs."""
    return -p[row, j] * soft_sign(v * p[row + 1, j]), (0.0 * z,)


SMOOTH = 0.06
"""Angular frequency, over level / transition speed, that steps resolve while a motion creeps: a step of RK4 is then
0.4 of the creep's time constant, and 1.6 at the steps of fits, where 2.8 are unstable."""


def is_smooth(p: Values) -> bool:
    """Return whether the sign is smoothed; at 0 it is the ideal one, which holds a motion at rest."""
    return p["transition_speed"] > 0.0


def constants(p: Values) -> tuple[float, ...]:
    """Return the constants of `smoothed`, which does nothing in a lane with the ideal sign."""
    return (p["level"], 1.0 / p["transition_speed"]) if is_smooth(p) else (0.0, 0.0)


MECHANISM = OscillatorMechanism(
    id="friction.coulomb",
    statement="Dry friction of {level} opposes the motion.",
    forms={
        "transition_speed": "Dry friction of {level} opposes the motion; its sign is smooth over {transition_speed}."
    },
    parameters=(
        coefficient("level", "{z}/s^2", "of the friction", lambda s: s.acceleration, low=0.0, kinked=True),
        shape(
            "transition_speed",
            "{z}/s",
            "over which its sign changes, by a tanh; 0: the ideal sign, with stiction",
            lambda s: s.velocity,
            default=0.0,
            low=0.0,
            simplest=0.0,
            shape_range=(0.001, 1.0),
            grid=4,
        ),
    ),
    terms={"friction": lambda p: 0.0 if is_smooth(p) else p["level"]},
    memory=Memory(smoothed, 1, constants, acts=is_smooth),
    fastest_rate=lambda p, speed: SMOOTH * p["level"] / p["transition_speed"] if is_smooth(p) else 0.0,
    transition=lambda p: (p["transition_speed"], p["level"]) if is_smooth(p) else None,
)
