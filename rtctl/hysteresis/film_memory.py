"""What a film has been through, as an estimator knows it: for the estimator and the feedforward that take over.

Relays remember the turning points that no larger motion has wiped. These were made by the device as it was then; a
model that only follows the last seconds of a run, or that was wrong for a while, has others.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from rtctl.border.arrays import FloatArray


class FilmMemory(NamedTuple):
    """Temperatures as the squares of the currents that hold them [mA^2], and relays."""

    power: float
    film: FloatArray
    """Stack of -ln R."""
    beam: FloatArray
    """Stack of the deflection."""
    hotter: float
    """The same a little hotter."""
    hotter_film: FloatArray
    hotter_beam: FloatArray
    filter: FloatArray
    """The filter's state without its first two entries (n,): heat, model error, variances; empty: there is none."""


@runtime_checkable
class Inheriting(Protocol):
    """An estimator or a feedforward whose model has a film."""

    def inherit(self, memory: FilmMemory) -> None:
        """Take over what the film has been through."""
        ...


@runtime_checkable
class Remembering(Protocol):
    """An estimator that knows what the film has been through."""

    def film_memory(self) -> FilmMemory:
        """Return it, as copies."""
        ...


@runtime_checkable
class Drifting(Inheriting, Protocol):
    """An estimator whose model may drift with time."""

    def drift_from_now(self) -> None:
        """Let what drifts begin to do so at the present sample."""
        ...


def save_memory(path: Path, memory: FilmMemory) -> None:
    """Write a memory as an .npz file."""
    np.savez(
        path, power=memory.power, film=memory.film, beam=memory.beam, hotter=memory.hotter,
        hotter_film=memory.hotter_film, hotter_beam=memory.hotter_beam, filter=memory.filter,
    )  # fmt: skip


def load_memory(path: Path) -> FilmMemory:
    """Read what `save_memory` wrote."""
    with np.load(path) as found:
        power, hotter = float(found["power"]), float(found["hotter"])
        arrays = {name: found[name] for name in ("film", "beam", "hotter_film", "hotter_beam", "filter")}
    return FilmMemory(power=power, hotter=hotter, **arrays)
