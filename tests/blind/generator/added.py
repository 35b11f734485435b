"""Effects of formats.md section 6 in the spring, the drive and the base: made where asked for, drawn by no seed.

So the seeds of the reported tables keep their cases.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .effects import Draw, Recipe, Surroundings
from .outside import stop
from .plan import FloatArray


def stop_one_sided(rng: np.random.Generator, around: Surroundings) -> Recipe:
    """An elastic stop beyond a gap from rest, on the upper side."""
    return stop(rng, around, both=0.0)


def stop_two_sided(rng: np.random.Generator, around: Surroundings) -> Recipe:
    """The same on both sides."""
    return stop(rng, around, both=1.0)


def stiffness_clearance(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """The spring is stretched by y less what lies within +-gap of a centre, which is at most half of the gap off."""
    centre = float(rng.choice([0.0, rng.uniform(-0.5, 0.5)]))
    return Recipe(
        id="stiffness.clearance",
        place="stiffness",
        apply=lambda plan, a: replace(plan.having(PLAY=a, PLAY_CENTRE=centre), finer=12),
        sizes=lambda a: {"gap": (a, 1, 0, 0), "centre": (a * centre, 1, 0, 0)},
        largest=3.0,
    )


def stiffness_gravity(rng: np.random.Generator, around: Surroundings) -> Recipe:
    """A share of the small-swing stiffness is a pendulum's: L sin(y / L), L one radian."""
    k = 1.0 / around.radian
    return Recipe(
        id="stiffness.gravity",
        place="stiffness",
        apply=lambda plan, a: plan.having(
            K=1.0 - a, RIPPLE=a * around.radian, RIPPLE_KAPPA=k, STOP_CENTRE=0.0
        ),
        sizes=lambda a: {"coefficient": (a, 0, -2, 0)},
        guess=0.5,
        largest=1.0,
    )


def base_motion(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """A tone acts on the device beside the drive, its phase another one in each record."""
    w = float(np.exp(rng.uniform(np.log(0.4), np.log(2.2))))
    phases = rng.uniform(0.0, 2 * np.pi, 64)
    return Recipe(
        id="base.motion",
        place="drive",
        apply=lambda plan, a: replace(plan, push=lambda record, t: a * np.cos(w * t + phases[record.number])),
        sizes=lambda a: {"amplitude": (a, 1, -2, 0), "angular_frequency": (w, 0, -1, 0)},
    )


def actuator_backlash(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """A play operator of half-width d between the drive and the device."""

    def behind(u: FloatArray, d: float) -> FloatArray:
        w, made = 0.0, np.empty(u.size)
        for k, value in enumerate(u.ravel()):
            w = min(max(w, value - d), value + d)
            made[k] = w
        return made.reshape(u.shape)

    return Recipe(
        id="actuator.backlash",
        place="drive",
        apply=lambda plan, a: replace(plan, drive=(*plan.drive, lambda u: behind(u, a))),
        sizes=lambda a: {"half_width": (a, 0, 0, 1)},
        largest=2.0,
    )


ADDED: dict[str, Draw] = {
    "stop.one_sided": stop_one_sided,
    "stop.two_sided": stop_two_sided,
    "stiffness.clearance": stiffness_clearance,
    "stiffness.gravity": stiffness_gravity,
    "base.motion": base_motion,
    "actuator.backlash": actuator_backlash,
}
