"""The plant with the effects that are on, and its response to one record."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from .kernel import run
from .physics import FloatArray, Grains, Physics

STEP_S = 1.2e-4
STEP_OF_STAIRCASE_S = 1e-3  # only the ends of its holds matter


@dataclass(frozen=True, kw_only=True)
class Input:
    """One record's input; `number` tells repeats (same number) from others, `position` its place in the session."""

    number: int
    position: int
    use: str
    excitation: str
    current: FloatArray
    rate_Hz: float


class Output(NamedTuple):
    """Noise-free readings."""

    resistance: FloatArray
    deflection: FloatArray
    temperature: FloatArray


Course = Callable[[Input, FloatArray], FloatArray]
"""What a slow effect does over a record: (record, time) -> value at each sample. Not during `identify` records:
those were taken on the fresh device in a steady room."""


@dataclass(frozen=True, kw_only=True)
class Plant:
    """`ambient` adds to the room's temperature [K]; `gain_R`, `gain_D` add to 1."""

    physics: Physics
    electric: Grains
    structural: Grains
    ambient: Course | None = None
    gain_R: Course | None = None
    gain_D: Course | None = None

    def having(self, **physics: Any) -> Plant:
        """The same with other numbers."""
        return replace(self, physics=self.physics._replace(**physics))


def simulate(plant: Plant, record: Input) -> Output:
    """The plant's response, all effects on."""
    return _respond(plant, record, twin=False)


def twin(plant: Plant, record: Input) -> Output:
    """First-order heating by the current's square, then the plant's own static maps; nothing slow or dynamic."""
    return _respond(plant, record, twin=True)


def _respond(plant: Plant, record: Input, *, twin: bool) -> Output:
    n, p = record.current.size, plant.physics
    t = np.arange(n) / record.rate_Hz

    def course(of: Course | None) -> FloatArray:
        return np.zeros(n) if of is None or twin or record.use == "identify" else of(record, t)

    quiet = p if record.use != "identify" else p._replace(widening=0.0, hum=0.0)
    if twin:
        quiet = quiet._replace(widening=0.0, hum=0.0)
    dt = 1.0 / record.rate_Hz
    substeps = int(np.ceil(dt / STEP_S))
    if record.use == "identify":
        substeps = int(np.ceil(dt / STEP_OF_STAIRCASE_S))
        if p.tcr == p.loss == p.sense_heat == p.film_power == p.latent == 0.0:
            substeps = min(substeps, 4)  # heating is linear, then its steps are exact however long
    R, D, T = run(
        quiet,
        plant.electric,
        plant.structural,
        record.current,
        p.ambient + course(plant.ambient),
        dt,
        1 if twin else substeps,  # the twin's steps are exact
        twin,
    )
    return Output(R * (1.0 + course(plant.gain_R)), D * (1.0 + course(plant.gain_D)), T)
