"""Isolability: which mechanisms this dataset can tell apart at all, before any cause is named.

Each mechanism has a direction s in which it would move the outputs; s_perp is the part that the nominal parameters
cannot follow. The visible share is |s_perp| / |s|. Where the absolute cosine between the parts s_perp of two mechanisms
is near 1, no method separates them in these data.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis


class Isolability(NamedTuple):
    """Visible shares and mutual cosines of k mechanisms, in the catalogue's order."""

    ids: tuple[str, ...]
    """Ids of the mechanisms."""
    visible: FloatArray
    """Visible shares (k,): parts of the directions that no nominal parameter can follow."""
    cosine: FloatArray
    """Absolute cosines (k, k) between these parts; NaN where one of the two is not visible."""

    def closest(self, identity: str, least: float = 0.95) -> tuple[str, ...]:
        """Return the ids of mechanisms whose cosine with `identity` exceeds `least`, nearest first."""
        row = self.cosine[self.ids.index(identity)]
        others = [
            (float(row[k]), name) for k, name in enumerate(self.ids) if name != identity and row[k] > least
        ]
        return tuple(name for _, name in sorted(others, reverse=True))


def compute_isolability(examined: TestedHypothesis) -> Isolability:
    """Return the isolability at a tested hypothesis.

    A mechanism with several amplitudes or shapes is represented by its most visible one.
    """
    projected = examined.projected
    best: dict[str, int] = {}
    for k, direction in enumerate(examined.directions):
        name = direction.mechanism
        if name and (name not in best or projected.visible[k] > projected.visible[best[name]]):
            best[name] = k
    chosen = np.array(list(best.values()), dtype=np.intp)
    usable = projected.usable[chosen]
    size = np.sqrt(np.where(usable, projected.visible[chosen], np.nan))
    cosine = np.abs(projected.left[np.ix_(1 + chosen, 1 + chosen)]) / size[:, None] / size
    return Isolability(tuple(best), np.sqrt(projected.visible[chosen]), np.clip(cosine, 0.0, 1.0))
