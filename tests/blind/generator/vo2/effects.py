"""Every vo2 id of formats.md section 5 as the textbooks have it: shape drawn from the seed, amplitude `a` free.

An effect with a static part is normalised so that the largest current reaches the same temperature: the range of the
device stays, the shape and the dynamics move.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .physics import FloatArray, Grains
from .plant import Course, Input, Plant

Sizes = dict[str, tuple[float, str]]


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """One effect with its shape drawn; two effects of a pair act at different places (the id's first word)."""

    id: str
    apply: Callable[[Plant, float], Plant]
    sizes: Callable[[float], Sizes]
    guess: float
    largest: float
    variant: str = "usual"
    slowest: Callable[[float], float] = lambda a: 0.0
    """s, slowest time constant that a staircase must wait for."""
    absorbed: bool = True
    """Whether the twin of the plant with the effect is what an identified model simulates; else of that without."""


Draw = Callable[[np.random.Generator, Plant, float], Recipe]
"""(rng, nominal plant, longest record [s]) -> recipe."""


def number_of(field: str, unit: str, sign: float = 1.0) -> dict[str, Any]:
    return {
        "apply": lambda plant, a: plant.having(**{field: sign * a}),
        "sizes": lambda a: {field: (sign * a, unit)},
    }


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def second_time_constant(rng: np.random.Generator, _: Plant, __: float) -> Recipe:
    """A share g of the heating goes through a slower body (anchor, substrate): theta = x1 + x2,
    tau x1' = (1 - g) c i^2 - x1, tau2 x2' = g c i^2 - x2."""
    tau = _log_uniform(rng, 0.012, 0.15)
    return Recipe(
        id="thermal.second_time_constant",
        apply=lambda plant, a: plant.having(second_share=a, second_tau=tau),
        sizes=lambda a: {"share": (a, "1"), "time_constant": (tau, "s")},
        guess=0.15,
        largest=0.9,
        slowest=lambda a: tau,
    )


def nonlinear_loss(_: np.random.Generator, __: Plant, ___: float) -> Recipe:
    """Conductance grows with temperature (convection, radiation): loss theta (1 + a theta/top) / (1 + a)."""
    on = number_of("loss", "1")
    return Recipe(id="thermal.nonlinear_loss", guess=1.0, largest=12.0, slowest=lambda a: 0.002 * a, **on)


def latent_heat(_: np.random.Generator, __: Plant, ___: float) -> Recipe:
    """The transition takes heat: tau (theta' + L phi') = S - theta, phi the structural fraction, L in K."""
    return Recipe(
        id="thermal.latent_heat",
        guess=12.0,
        largest=120.0,
        slowest=lambda a: 2e-4 * a,
        **number_of("latent", "K"),
    )


def ambient_drift(rng: np.random.Generator, _: Plant, longest: float) -> Recipe:
    """The room warms or cools at a steady rate from each record's start."""
    sign = float(rng.choice([-1.0, 1.0]))
    return Recipe(
        id="thermal.ambient_drift",
        apply=lambda plant, a: replace(plant, ambient=_ramp(sign * a / longest)),
        sizes=lambda a: {"rate": (sign * a / longest, "K/s")},
        guess=2.0,
        largest=20.0,
    )


def heater_tcr(_: np.random.Generator, __: Plant, ___: float) -> Recipe:
    """The heater's resistance, so its power at a given current, grows with temperature: c i^2 (1 + beta theta)."""
    on = number_of("tcr", "1/K")
    return Recipe(id="heater.tcr", guess=0.005, largest=0.02, slowest=lambda a: 0.2 * a, **on)


def delay(_: np.random.Generator, __: Plant, ___: float) -> Recipe:
    """The current acts d later than commanded; d is no whole number of samples."""
    return Recipe(id="actuation.delay", guess=3e-4, largest=0.02, **number_of("delay", "s"))


def deadband(_: np.random.Generator, __: Plant, ___: float) -> Recipe:
    """Dead zone: only the current beyond d heats, with the gain that keeps the range."""
    return Recipe(id="actuation.deadband", guess=1.0, largest=6.0, **number_of("deadband", "mA"))


def resonance(rng: np.random.Generator, _: Plant, __: float) -> Recipe:
    """The beam has a mode: y'' + w/Q y' + w^2 y = w^2 (deflection at rest), of frequency 200 Hz / a."""
    quality = _log_uniform(rng, 6.0, 50.0)
    return Recipe(
        id="structure.resonance",
        apply=lambda plant, a: plant.having(resonance=200.0 / a, quality=quality),
        sizes=lambda a: {"frequency": (200.0 / a, "Hz"), "quality": (quality, "1")},
        guess=0.7,
        largest=8.0,
        slowest=lambda a: quality * a / (200.0 * np.pi),
    )


def rate_dependence(_: np.random.Generator, __: Plant, ___: float) -> Recipe:
    """The relays see temperature through a lag: tau_h T_h' = T - T_h; semiconductor and expansion follow T itself."""
    return Recipe(
        id="hysteresis.rate_dependence",
        guess=4e-4,
        largest=0.05,
        slowest=lambda a: 1.8e-3 + a,
        **number_of("transition_tau", "s"),
    )


def creep(rng: np.random.Generator, _: Plant, __: float) -> Recipe:
    """A share of the fraction follows late, by three elements a factor 3 apart: close to log(t)."""
    tau = _log_uniform(rng, 0.01, 0.06)
    return Recipe(
        id="hysteresis.creep",
        apply=lambda plant, a: plant.having(creep=a, creep_tau=tau),
        sizes=lambda a: {"share": (a, "1"), "fastest": (tau, "s")},
        guess=0.15,
        largest=0.9,
        slowest=lambda a: 9.0 * tau,
    )


def shape(rng: np.random.Generator, plant: Plant, _: float) -> Recipe:
    """A few large domains that switch at once, of one share a of the film: steps in the loop (avalanches)."""
    domains = int(rng.integers(3, 7))
    width = rng.uniform(1.5, 6.0, domains)
    place = rng.normal(size=domains) * 4.0

    def mixed(grains: Grains, a: float) -> Grains:
        centre = float(np.mean(grains.centre))
        return Grains(
            half_width=np.r_[grains.half_width, width],
            weight=np.r_[(1.0 - a) * grains.weight, np.full(domains, a / domains)],
            centre=np.r_[grains.centre, centre + place],
            spread=np.r_[grains.spread, np.full(domains, 0.15)],
            skew=grains.skew,
        )

    return Recipe(
        id="hysteresis.shape",
        apply=lambda plant, a: replace(
            plant, electric=mixed(plant.electric, a), structural=mixed(plant.structural, a)
        ),
        sizes=lambda a: {"share": (a, "1"), "domains": (float(domains), "1")},
        guess=0.3,
        largest=1.0,
        absorbed=False,
    )


def self_heating(_: np.random.Generator, __: Plant, ___: float) -> Recipe:
    """The sense current heats the film by Is^2 R: S = c i^2 + a R(T) / R(25 degC), a in K."""
    return Recipe(
        id="sensor.self_heating",
        guess=8.0,
        largest=150.0,
        slowest=lambda a: 4e-3,
        **number_of("sense_heat", "K"),
    )


def sensor_lag(_: np.random.Generator, __: Plant, ___: float) -> Recipe:
    """The resistance reading passes a first-order filter; the deflection's does not."""
    return Recipe(
        id="sensor.lag",
        guess=3e-4,
        largest=0.05,
        slowest=lambda a: 1.8e-3 + a,
        **number_of("sensor_tau", "s"),
    )


def ageing(rng: np.random.Generator, _: Plant, longest: float) -> Recipe:
    """The resistance reading drifts: R (1 + r t), t from each record's start."""
    sign = float(rng.choice([-1.0, 1.0]))
    return Recipe(
        id="sensor.ageing",
        apply=lambda plant, a: replace(plant, gain_R=_ramp(sign * a / longest)),
        sizes=lambda a: {"relative_rate": (sign * a / longest, "1/s")},
        guess=0.2,
        largest=0.9,
    )


def crosstalk(rng: np.random.Generator, plant: Plant, _: float) -> Recipe:
    """The heater's current leaks into the reading: R + k i."""
    scale = plant.physics.semiconductor / plant.physics.top_current / 10.0
    return Recipe(
        id="sensor.crosstalk",
        apply=lambda plant, a: plant.having(crosstalk=a * scale),
        sizes=lambda a: {"leak": (a * scale, "ohm/mA")},
        guess=1.0,
        largest=6.0,
    )


def _ramp(rate: float) -> Course:
    def course(_: Input, t: FloatArray) -> FloatArray:
        return rate * t

    return course


CATALOGUE: dict[str, Draw] = {
    "thermal.second_time_constant": second_time_constant,
    "thermal.nonlinear_loss": nonlinear_loss,
    "thermal.latent_heat": latent_heat,
    "thermal.ambient_drift": ambient_drift,
    "heater.tcr": heater_tcr,
    "actuation.delay": delay,
    "actuation.deadband": deadband,
    "structure.resonance": resonance,
    "hysteresis.rate_dependence": rate_dependence,
    "hysteresis.creep": creep,
    "hysteresis.shape": shape,
    "sensor.self_heating": self_heating,
    "sensor.lag": sensor_lag,
    "sensor.ageing": ageing,
    "sensor.crosstalk": crosstalk,
}
SLOW_STAIRCASE = 0.6  # s: no staircase waits longer for what is slower

NEVER_TOGETHER: list[set[str]] = [
    {"actuation.delay", "hysteresis.rate_dependence"},
    {"heater.tcr", "thermal.nonlinear_loss"},
    {"thermal.second_time_constant", "hysteresis.creep"},
]
"""Act at different places by name, but nearly the same on most inputs: a pair of them is not asked for."""
