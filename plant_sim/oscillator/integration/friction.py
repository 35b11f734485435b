"""Dry friction inside a step of an integrator: a force against the motion that holds it at rest up to its level.

level sign v  |  (level + excess exp(-(fading v)^2)) sign v        Coulomb  |  Stribeck

While the motion goes on, the force is smooth over a step (its sign is kept), and the method keeps its order. Where a
step ends beyond a turning point, the velocity in it is a parabola: the turning point is its root, after which the force
points the other way or holds. A motion at rest stays there to the last bit until the other forces exceed the level
inside a step. What is neglected is of order h^3 at each turning point.

Turning points are rare, so the integrator only notes each step, for all lanes at once, and looks afterwards whether
any lane turned: a branch inside its loop over lanes would cost a factor of five.
"""

from __future__ import annotations

import math
from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.equation.elementary import fading
from plant_sim.oscillator.equation.terms import FRICTION, FRICTION_EXCESS, FRICTION_FADING

NOTED = 5
"""Number of values noted for a step and lane: displacement, velocity, acceleration at its start and end, friction."""


@law
def no_resistance(v: float, a: float, p: Any, j: int) -> Any:
    """Return 0: a motion without dry friction."""
    return 0.0


@law
def constant(held: float, v1: float, v: float, p: Any, j: int) -> Any:
    """Return the friction at the velocity `v` in a step that starts at `v1`: what it is all the step long."""
    return held


@law
def not_noted(noted: Any, j: int, z1: float, v1: float, a1: float, a4: float, held: float) -> None:
    """Note nothing: no step has to be corrected."""


@law
def as_it_is(z: Any, v: Any, noted: Any, h: float, p: Any) -> None:
    """Leave the end of the step as it is."""


@law
def resistance(v: float, a: float, p: Any, j: int) -> Any:
    """Return the friction [{z}/s^2] during a step that starts at velocity `v`, where the other forces are `a`."""
    level = p[FRICTION, j]
    against = level if v > 0.0 else -level
    return min(max(a, -level), level) if v == 0.0 else against


@law
def note(noted: Any, j: int, z1: float, v1: float, a1: float, a4: float, held: float) -> None:
    """Keep what `settle` may need of lane `j`; accelerations with friction."""
    noted[0, j], noted[1, j], noted[2, j], noted[3, j], noted[4, j] = z1, v1, a1, a4, held


@law
def any_turned(v: Any, noted: Any) -> bool:
    """Return whether a lane turned within the step, or started it at rest; all are looked at, without a branch."""
    turned = 0
    for j in range(len(v)):
        turned += 1 if v[j] * noted[1, j] <= 0.0 else 0
    return turned > 0


@law
def settle(z: Any, v: Any, noted: Any, h: float, p: Any) -> None:
    """Put right the lanes that turned within the step of `h`, or started it at rest."""
    if not any_turned(v, noted):
        return
    for j in range(len(z)):
        if noted[1, j] == 0.0:
            if abs(noted[4, j]) < p[FRICTION, j]:
                z[j], v[j] = from_rest(noted[0, j], noted[3, j], noted[4, j], h, p[FRICTION, j])
        elif v[j] * noted[1, j] < 0.0:
            z1, v1, a1, held = noted[0, j], noted[1, j], noted[2, j], noted[4, j]
            z[j], v[j] = through_turn(z1, v1, a1, z[j], v[j], held, h)


@law
def from_rest(z1: float, a4: float, held: float, h: float, level: float) -> Any:
    """End of a step that starts held: at rest, or in motion since the other forces exceeded the level.

    They grow linearly from `held` by a4, so the velocity since then is a parabola and the displacement a cubic.
    """
    other = a4 + held
    excess = abs(other) - level
    if not excess > 0.0:
        return z1, 0.0
    since = h * excess / abs(a4)
    v = math.copysign(0.5 * excess * since, other)
    return z1 + v * since / 3.0, v


@law
def through_turn(z1: float, v1: float, a1: float, z: float, v: float, held: float, h: float) -> Any:
    """End of a step from (z1, v1) that friction `held` took to (z, v) beyond a turning point."""
    speed, sign = abs(v1), math.copysign(1.0, v1)
    slope = sign * a1 * h
    bend = sign * (v - v1) - slope
    x = (
        2.0 * speed / (math.sqrt(max(slope * slope - 4.0 * bend * speed, 0.0)) - slope)
    )  # in parts of the step
    left = h * (1.0 - x)
    beyond = v + 2.0 * held * left
    if beyond * v1 >= 0.0:
        return z1 + sign * h * x * (speed + x * (0.5 * slope + x * bend / 3.0)), 0.0
    return z + held * left * left, beyond


@law
def sliding(v: float, p: Any, j: int) -> Any:
    """Return the size of the friction at the velocity `v`, which fades from its break-away level."""
    x = v * p[FRICTION_FADING, j]
    return p[FRICTION, j] + p[FRICTION_EXCESS, j] * fading(x * x)


@law
def fading_resistance(v: float, a: float, p: Any, j: int) -> Any:
    """Return the friction at the start of a step, as `resistance`."""
    level = sliding(v, p, j)
    against = level if v > 0.0 else -level
    return min(max(a, -level), level) if v == 0.0 else against


@law
def faded(held: float, v1: float, v: float, p: Any, j: int) -> Any:
    """Return the friction at the velocity `v` in a step that starts at `v1` with `held`; its sign is kept."""
    level = sliding(v, p, j)
    against = level if held > 0.0 else -level
    rests = (v1 == 0.0) & (abs(held) < p[FRICTION, j] + p[FRICTION_EXCESS, j])
    return held if rests else against


@law
def settle_faded(z: Any, v: Any, noted: Any, h: float, p: Any) -> None:
    """Put right the lanes that turned within the step of `h`, or started it at rest, as `settle`.

    Beyond a turning point the friction is its mean over the velocities there, whose mean square is v^2 / 3.
    """
    if not any_turned(v, noted):
        return
    for j in range(len(z)):
        if noted[1, j] == 0.0:
            level = p[FRICTION, j] + p[FRICTION_EXCESS, j]
            if abs(noted[4, j]) < level:
                z[j], v[j] = from_rest(noted[0, j], noted[3, j], noted[4, j], h, level)
        elif v[j] * noted[1, j] < 0.0:
            z1, v1, a1 = noted[0, j], noted[1, j], noted[2, j]
            held = math.copysign(sliding(v[j] / math.sqrt(3.0), p, j), noted[4, j])
            z[j], v[j] = through_turn(z1, v1, a1, z[j], v[j], held, h)


COULOMB = {"resistance": resistance, "note": note, "settle": settle}
"""Laws of an equation with dry friction of one level."""
STRIBECK = {"resistance": fading_resistance, "within": faded, "note": note, "settle": settle_faded}
"""Laws of an equation with dry friction that fades from its break-away level."""
