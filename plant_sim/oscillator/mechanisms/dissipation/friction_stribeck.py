"""`friction.stribeck`: - (level + excess exp(-(z' / transition_speed)^2)) sign z', with stiction up to level + excess.

Reference: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083, eq. 6 with delta = 2.
"""

from __future__ import annotations

from plant_sim.oscillator.mechanism import OscillatorMechanism, coefficient, shape

MECHANISM = OscillatorMechanism(
    id="friction.stribeck",
    statement=(
        "Dry friction of {level} while sliding opposes the motion, and {excess} more at break-away, which fades over "
        "{transition_speed} (Stribeck)."
    ),
    parameters=(
        coefficient(
            "level",
            "{z}/s^2",
            "of the friction of a fast motion",
            lambda s: s.acceleration,
            low=0.0,
            kinked=True,
        ),
        coefficient(
            "excess",
            "{z}/s^2",
            "of the break-away level beyond it",
            lambda s: s.acceleration,
            low=0.0,
            kinked=True,
        ),
        shape(
            "transition_speed",
            "{z}/s",
            "over which the excess fades",
            lambda s: s.velocity,
            shape_range=(0.03, 2.0),
            grid=3,
        ),
    ),
    terms={
        "friction": "level",
        "friction_excess": "excess",
        "friction_fading": lambda p: 1.0 / p["transition_speed"],
    },
    transition=lambda p: (p["transition_speed"], p["excess"]),
    generalises={"friction.coulomb": lambda p: {"level": p["level"]}},
)
