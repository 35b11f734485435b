"""The device of a case: grains, heating, electrical and mechanical read-outs, drawn from the seed."""

from __future__ import annotations

import numpy as np
from scipy.stats import gamma

from ..truth import Quantity
from .physics import Grains, Physics
from .plant import Plant

WIDTHS = 16


def draw_device(rng: np.random.Generator) -> tuple[Plant, float]:
    """The device without effects, and its smallest current [mA]."""
    ambient, heating = rng.uniform(20.0, 26.0), rng.uniform(0.6, 1.4)
    centre = rng.uniform(57.0, 67.0)
    width, spread = rng.uniform(2.2, 4.2), rng.uniform(2.2, 4.5)
    top = centre + 3.2 * (spread + 0.5 * width) + rng.uniform(6.0, 12.0) - ambient
    bottom = rng.uniform(0.02, 0.2) * top
    stroke = rng.uniform(45.0, 110.0)
    physics = Physics(
        tau=1.8e-3 * float(np.exp(rng.normal(scale=0.2))),
        heating=heating,
        ambient=ambient,
        top=top,
        top_current=float(np.sqrt(top / heating)),
        semiconductor=float(np.exp(rng.uniform(np.log(2e4), np.log(6e5)))),
        activation=rng.uniform(2000.0, 3600.0),
        metal=1.0,
        mixing=float(rng.choice([0.0, rng.uniform(0.05, 0.25)])),
        stroke=stroke,
        expansion=stroke / 60.0 * rng.uniform(0.25, 0.45),
    )
    physics = physics._replace(metal=physics.semiconductor / np.exp(rng.uniform(np.log(30.0), np.log(150.0))))
    skew, tie = rng.uniform(0.7, 1.5), rng.uniform(-0.5, 0.5)
    electric = draw_grains(rng, centre, width, spread, skew, tie)
    structural = draw_grains(
        rng,
        centre + rng.uniform(-1.0, 1.0),
        width * rng.uniform(0.85, 1.15),
        spread * rng.uniform(0.9, 1.3),
        rng.uniform(0.7, 1.5),
        tie,
    )
    plant = Plant(physics=physics, electric=electric, structural=structural)
    return plant, float(np.sqrt(bottom / heating))


def draw_grains(
    rng: np.random.Generator, centre: float, width: float, spread: float, skew: float, tie: float
) -> Grains:
    """Half-widths gamma-distributed about `width`, a quarter of it wide; centres move with the width by `tie` K/K."""
    shape = rng.uniform(10.0, 22.0)
    places = (np.arange(WIDTHS) + 0.5) / WIDTHS
    half = width / shape * gamma.ppf(places, shape)
    return Grains(
        half_width=half,
        weight=np.full(WIDTHS, 1.0 / WIDTHS),
        centre=centre + tie * (half - width),
        spread=np.full(WIDTHS, spread * 0.62),
        skew=skew,
    )


def parameters_of(p: Physics) -> dict[str, Quantity]:
    """The nominal device in units."""
    values = {
        "time_constant": (p.tau, "s"),
        "heating": (p.heating, "K/mA^2"),
        "ambient": (p.ambient, "degC"),
        "resistance_semiconductor": (p.semiconductor, "ohm"),
        "resistance_metal": (p.metal, "ohm"),
        "activation": (p.activation, "K"),
        "stroke": (p.stroke, "um"),
        "expansion": (p.expansion, "um/K"),
    }
    return {name: Quantity(value=float(value), unit=unit) for name, (value, unit) in values.items()}
