"""How far an effect moves the response, and the amplitude at which it moves it by a wanted share."""

from __future__ import annotations

import numpy as np

from ..sizing import find_amplitude
from .effects import Recipe
from .physics import FloatArray
from .plant import Input, Output, Plant, simulate, twin


def distinct(inputs: list[Input]) -> list[Input]:
    """Fit records without repeats."""
    return list({r.number: r for r in reversed(inputs) if r.use == "fit"}.values())[::-1]


def share_moved(without: list[Output], having: list[Output]) -> float:
    """rms(having - without) / rms(having about its mean), all records, the worse of both outputs."""
    shares = []
    for output in ("resistance", "deflection"):
        b, a = (np.concatenate([getattr(o, output) for o in outputs]) for outputs in (without, having))
        shares.append(float(np.sqrt(np.mean((a - b) ** 2)) / a.std()))
    return max(shares)


def share_of(plant: Plant, identified: Plant, records: list[Input]) -> float:
    """Share by which the plant differs from what its quasi-static identification would simulate."""
    return share_moved([twin(identified, r) for r in records], [simulate(plant, r) for r in records])


def amplitude_for(share: float, recipe: Recipe, nominal: Plant, records: list[Input]) -> tuple[float, float]:
    """Amplitude at which this effect alone moves the response by `share`, and the share reached over whole records.

    Raises NoSuchSizeError where none does.
    """

    def reached(a: float) -> float:
        having = recipe.apply(nominal, a)
        value = share_of(having, having if recipe.absorbed else nominal, records)
        return value if np.isfinite(value) else np.inf

    return find_amplitude(reached, share, recipe.guess, recipe.largest)


def pooled(outputs: list[Output], name: str) -> FloatArray:
    """One output of all records, one after the other."""
    return np.concatenate([getattr(output, name) for output in outputs])
