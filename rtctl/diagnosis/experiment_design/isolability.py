"""Isolability: which mechanisms this dataset can tell apart at all, before any cause is named.

Each mechanism has a direction s in which it would move the outputs; s_perp is the part that the nominal parameters
cannot follow. The visible share is |s_perp| / |s|. Where the absolute cosine between the parts s_perp of two mechanisms
is near 1, no method separates them in these data.

Where s_perp is next to nothing, the effect acts unseen: its part is in the fitted parameters and starts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis

STARTS = "the starts of the records"
SEEN = 0.9
"""Probability with which a test of one mechanism sees an effect that counts as seen."""
STARTS_ALONE = 1e-4
"""Fraction of a direction's squares beyond the starts of the records, below which these follow it by themselves."""
LEADING = 0.5
"""Share of the largest coefficient of a nominal parameter from which another one is told as well."""


class Isolability(NamedTuple):
    """Visible shares and mutual cosines of k mechanisms, in the catalogue's order."""

    ids: tuple[str, ...]
    """Ids of the mechanisms."""
    visible: FloatArray
    """Visible shares (k,): parts of the directions that no nominal parameter can follow."""
    cosine: FloatArray
    """Absolute cosines (k, k) between these parts; NaN where one of the two is not visible."""
    followers: tuple[tuple[str, ...], ...]
    """By mechanism what follows it, most first: names of nominal parameters, and `STARTS`."""
    unseen: FloatArray
    """(k,) RMS by which each mechanism may move the outputs, over the noise, and stay unseen; infinite: however far,
    NaN: it moves nothing, as a limit that no motion reaches."""

    def followed(self, least: float) -> dict[tuple[str, ...], tuple[str, ...]]:
        """Return the mechanisms that may move the outputs by `least` times the noise unseen, by what follows them.

        One that the model has as its own parameter, as `stiffness.cubic` and stiffness_cubic, is no effect beside it.
        """
        found: dict[tuple[str, ...], tuple[str, ...]] = {}
        for name, by, unseen in zip(self.ids, self.followers, self.unseen.tolist(), strict=True):
            if unseen >= least and by != (name.replace(".", "_"),):
                found[by] = (*found.get(by, ()), name)
        return found

    def closest(self, identity: str, least: float = 0.95) -> tuple[str, ...]:
        """Return the ids of mechanisms whose cosine with `identity` exceeds `least`, nearest first."""
        row = self.cosine[self.ids.index(identity)]
        others = [
            (float(row[k]), name) for k, name in enumerate(self.ids) if name != identity and row[k] > least
        ]
        return tuple(name for _, name in sorted(others, reverse=True))


def compute_isolability(examined: TestedHypothesis, level: float = 0.01) -> Isolability:
    """Return the isolability at a tested hypothesis.

    A mechanism with several amplitudes or shapes is represented by its most visible one.

    Args:
        examined: The hypothesis.
        level: Significance level of its residual tests.
    """
    projected = examined.projected
    share = projected.beyond_own * np.where(projected.usable, projected.visible, 0.0)
    best: dict[str, int] = {}
    for k, direction in enumerate(examined.directions):
        name = direction.mechanism
        if name and (name not in best or projected.visible[k] > projected.visible[best[name]]):
            best[name] = k
    chosen = np.array(list(best.values()), dtype=np.intp)
    usable = projected.usable[chosen]
    size = np.sqrt(np.where(usable, projected.visible[chosen], np.nan))
    cosine = np.abs(projected.left[np.ix_(1 + chosen, 1 + chosen)]) / size[:, None] / size
    needed = float(norm.isf(0.5 * level / max(len(best), 1)) + norm.isf(1.0 - SEEN))
    with np.errstate(divide="ignore"):
        unseen = needed / np.sqrt(projected.samples * share[chosen])
    return Isolability(
        tuple(best), np.sqrt(projected.visible[chosen]), np.clip(cosine, 0.0, 1.0),
        tuple(_followers(examined, int(k)) for k in chosen), unseen,
    )  # fmt: skip


def _followers(examined: TestedHypothesis, k: int) -> tuple[str, ...]:
    """Return what follows direction `k`, most first: the records' starts, nominal parameters."""
    projected, hypothesis = examined.projected, examined.hypothesis
    if projected.beyond_own[k] < STARTS_ALONE:
        return (STARTS,)
    size = np.abs(projected.followed[k])
    names = [hypothesis.simulation.parameters[one].name for one in hypothesis.sensitivity.free]
    leading = [int(j) for j in np.argsort(-size, kind="stable") if size[j] > LEADING * size.max()]
    return tuple(names[j] for j in leading)
