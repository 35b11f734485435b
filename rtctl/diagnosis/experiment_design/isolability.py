"""Which effects this dataset can tell apart at all, before any name is drawn.

Of each mechanism the direction in which it would move the outputs, less what the nominal parameters can follow:
visible share |s_perp| / |s|, and |cos| between the remainders of two. Near 1, no method separates them here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis


class Isolability(NamedTuple):
    """Of k mechanisms, in the catalogue's order."""

    ids: tuple[str, ...]
    visible: FloatArray
    """(k,) share of its trace in the data that nothing nominal can follow."""
    cosine: FloatArray
    """(k, k) absolute; NaN where one of the two is not visible."""

    def closest(self, identity: str, least: float = 0.95) -> tuple[str, ...]:
        """Ids whose remainders are nearly parallel to this one's, nearest first."""
        row = self.cosine[self.ids.index(identity)]
        others = [
            (float(row[k]), name) for k, name in enumerate(self.ids) if name != identity and row[k] > least
        ]
        return tuple(name for _, name in sorted(others, reverse=True))


def isolability(examined: TestedHypothesis) -> Isolability:
    """At the hypothesis of `examined`; a mechanism with several amplitudes or shapes by its most visible one."""
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
