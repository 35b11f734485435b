"""The memoryless part of the equation of motion: rows of a table of coefficients, one column a lane.

z'' = gain u - (damping + damping_2 z^2 + damping_abs |v|) v - damping_even |v|
      - (stiffness + quadratic z + cubic z^2 + quintic z^4 + parametric u + drift t) z

and dry friction, which the integrator applies in each step. Most mechanisms are a coefficient in here and bring
no code of their own; the laws below are the same sum with fewer terms, for models that need no more.
"""

from __future__ import annotations

from collections.abc import Set
from typing import Any

from plant_sim.oscillator.equation.binding import law

TERMS = (
    "gain", "damping", "stiffness", "cubic",
    "quadratic", "quintic", "parametric", "drift", "damping_2", "damping_abs", "damping_even",
    "friction", "friction_excess", "friction_fading",
)  # fmt: skip
(
    GAIN, DAMPING, STIFFNESS, CUBIC,
    QUADRATIC, QUINTIC, PARAMETRIC, DRIFT, DAMPING_2, DAMPING_ABS, DAMPING_EVEN,
    FRICTION, FRICTION_EXCESS, FRICTION_FADING,
) = range(len(TERMS))  # fmt: skip
RUBBING = frozenset(TERMS[FRICTION:])
"""Terms of dry friction: its level, what it has more at break-away, 1 / the speed over which that fades."""
NOMINAL = frozenset(TERMS[:4])


@law
def nominal(z: float, v: float, u: float, t: float, p: Any, j: int) -> Any:
    """Return z'' of lane `j` of the nominal model; `p` (rows, lanes)."""
    return p[GAIN, j] * u - p[DAMPING, j] * v - (p[STIFFNESS, j] + p[CUBIC, j] * (z * z)) * z


@law
def elastic(z: float, v: float, u: float, t: float, p: Any, j: int) -> Any:
    """Return z'' with a restoring force of every order."""
    zz = z * z
    stiffness = p[STIFFNESS, j] + p[CUBIC, j] * zz + (p[QUADRATIC, j] * z + p[QUINTIC, j] * (zz * zz))
    return p[GAIN, j] * u - p[DAMPING, j] * v - stiffness * z


@law
def modulated(z: float, v: float, u: float, t: float, p: Any, j: int) -> Any:
    """Return z'' with a stiffness that the drive and time change."""
    stiffness = p[STIFFNESS, j] + p[CUBIC, j] * (z * z) + (p[PARAMETRIC, j] * u + p[DRIFT, j] * t)
    return p[GAIN, j] * u - p[DAMPING, j] * v - stiffness * z


@law
def damped(z: float, v: float, u: float, t: float, p: Any, j: int) -> Any:
    """Return z'' with a damping that depends on amplitude, speed and direction."""
    zz, speed = z * z, abs(v)
    damping = p[DAMPING, j] + (p[DAMPING_2, j] * zz + p[DAMPING_ABS, j] * speed)
    force = p[GAIN, j] * u - damping * v - (p[STIFFNESS, j] + p[CUBIC, j] * zz) * z
    return force - p[DAMPING_EVEN, j] * speed


@law
def polynomial(z: float, v: float, u: float, t: float, p: Any, j: int) -> Any:
    """Return z'' with every term."""
    zz = z * z
    stiffness = p[STIFFNESS, j] + p[CUBIC, j] * zz + (p[QUADRATIC, j] * z + p[QUINTIC, j] * (zz * zz))
    modulation = p[PARAMETRIC, j] * u + p[DRIFT, j] * t
    speed = abs(v)
    damping = p[DAMPING, j] + (p[DAMPING_2, j] * zz + p[DAMPING_ABS, j] * speed)
    force = p[GAIN, j] * u - damping * v - (stiffness + modulation) * z
    return force - p[DAMPING_EVEN, j] * speed


_LAWS = (
    (NOMINAL, nominal),
    (NOMINAL | {"quadratic", "quintic"}, elastic),
    (NOMINAL | {"parametric", "drift"}, modulated),
    (NOMINAL | {"damping_2", "damping_abs", "damping_even"}, damped),
)
_BESIDE_MEMORY = (_LAWS[1],)


def law_for(terms: Set[str], *, memory: bool = False) -> Any:
    """Return the cheapest law that has these terms (dry friction, `RUBBING`, is none of them).

    Beside a `memory` there are few laws: the memory's work hides what a shorter one saves, and each combination has to
    be compiled.
    """
    return next((law_ for known, law_ in (_BESIDE_MEMORY if memory else _LAWS) if terms <= known), polynomial)
