"""Effects that no vo2 id of formats.md section 5 names. A diagnosis should say `unexplained`, or nothing false."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..truth import OUTSIDE
from .effects import Draw, Recipe, number_of
from .physics import FloatArray
from .plant import Input, Plant


def widening_loop(_: np.random.Generator, __: Plant, ___: float) -> Recipe:
    """All hysteresis widths grow by a for each full cycle of temperature, from each record's start: fatigue."""
    return Recipe(id=OUTSIDE, variant="widening_loop", guess=0.01, largest=0.5, **number_of("widening", "1"))


def delaminating_beam(rng: np.random.Generator, _: Plant, __: float) -> Recipe:
    """In the first half of the fit records the beam loses a share of its deflection at once, and for good."""
    when = rng.uniform(0.2, 0.7)

    def course_of(a: float):  # type: ignore[no-untyped-def]
        def course(record: Input, t: FloatArray) -> FloatArray:
            lost = t >= when * t[-1] if record.position == 0 else np.ones(t.size, dtype=bool)
            return -a * lost

        return course

    return Recipe(
        id=OUTSIDE,
        variant="delaminating_beam",
        apply=lambda plant, a: replace(plant, gain_D=course_of(a)),
        sizes=lambda a: {"lost": (a, "1"), "part_of_first_record": (when, "1")},
        guess=0.15,
        largest=0.9,
    )


def runaway(_: np.random.Generator, __: Plant, ___: float) -> Recipe:
    """The heating grows as the film turns metallic, by 1 - a to 1: positive feedback, snaps, negative resistance.

    An id of the catalogue by now. It stays among these so that a seed goes on drawing what it drew.
    """
    return Recipe(
        id="thermal.phase_heating",
        variant="runaway",
        guess=0.05,
        largest=0.6,
        slowest=lambda a: 0.01,
        **number_of("film_power", "1"),
    )


def humid_reading(rng: np.random.Generator, _: Plant, longest: float) -> Recipe:
    """The resistance reading's gain walks at random, another path in each record: moisture on the pads."""
    seed = int(rng.integers(2**31))

    def course_of(a: float):  # type: ignore[no-untyped-def]
        def course(record: Input, t: FloatArray) -> FloatArray:
            knots = np.linspace(0.0, longest * 1.01, 200)
            own = np.random.default_rng([seed, record.position])
            walk = np.cumsum(own.normal(size=knots.size)) / np.sqrt(knots.size)
            return a * np.tanh(np.interp(t, knots, walk - walk[0]))

        return course

    return Recipe(
        id=OUTSIDE,
        variant="humid_reading",
        apply=lambda plant, a: replace(plant, gain_R=course_of(a)),
        sizes=lambda a: {"walk": (a, "1")},
        guess=0.2,
        largest=0.95,
    )


def slow_cooling(_: np.random.Generator, __: Plant, ___: float) -> Recipe:
    """Cooling has a longer time constant than heating, (1 + a) tau."""
    return Recipe(
        id=OUTSIDE,
        variant="slow_cooling",
        guess=0.3,
        largest=8.0,
        slowest=lambda a: 1.8e-3 * (1 + a),
        **number_of("slow_cooling", "1"),
    )


def mains_heating(rng: np.random.Generator, _: Plant, __: float) -> Recipe:
    """Mains current rides on the heater's: i + a sin(2 pi f t), f = 50 or 60 Hz; not in the staircases' averages."""
    hertz = float(rng.choice([50.0, 60.0]))
    return Recipe(
        id=OUTSIDE,
        variant="mains_heating",
        apply=lambda plant, a: plant.having(hum=a, hum_hz=hertz),
        sizes=lambda a: {"amplitude": (a, "mA"), "frequency": (hertz, "Hz")},
        guess=0.2,
        largest=3.0,
    )


OUTSIDE_CATALOGUE: dict[str, Draw] = {
    "widening_loop": widening_loop,
    "delaminating_beam": delaminating_beam,
    "runaway": runaway,
    "humid_reading": humid_reading,
    "slow_cooling": slow_cooling,
    "mains_heating": mains_heating,
}
