"""Which combinations of parameters the data determine, and which they leave open.

In relative parameters (value / |value|) the long axes of the covariance are what the data do not determine. A
parameter is confounded if it would be known well, were the others given, yet is not: then only a combination is known,
and is named. A parameter that is small and known to be small is insignificant, which is a different matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.statistics import NORMAL_95

CONFOUNDED_RELATIVE_ERROR = 0.05
"""Relative standard error of a direction above which it is confounded, if that is because of the other parameters."""
VARIANCE_INFLATION = 10.0
"""Ratio of a standard error to that with all other parameters given, above which a parameter is confounded."""
LEAST_SHARE = 0.1
"""Smallest component of a direction, relative to its largest, with which a parameter is named in it."""
INSENSITIVE_RATIO = 1e-9
"""Information relative to the largest, below which a parameter has no effect."""


class ConfoundedDirection(NamedTuple):
    """Parameters that can be traded against each other, and the combination of them that is determined."""

    names: tuple[str, ...]
    relative_error: float
    """Relative standard error along the direction."""
    fixed: str
    """The combination that the data fix, in words; "" where there is none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Determinability:
    """Findings on what the data determine; all empty where they determine everything."""

    insensitive: tuple[str, ...]
    """Parameters without any effect on these data."""
    confounded: tuple[ConfoundedDirection, ...]
    insignificant: tuple[str, ...]
    """Parameters whose interval contains zero."""
    condition: float
    """Condition number of the information matrix in relative parameters."""
    held: tuple[str, ...] = ()
    """Parameters that were not fitted, as no data tell them from the others."""

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of parameters without a trustworthy value of their own."""
        return tuple(
            dict.fromkeys(
                [*self.insensitive, *self.held, *(name for one in self.confounded for name in one.names)]
            )
        )

    def describe(self, *, with_intervals: bool = True) -> tuple[str, ...]:
        """Return the findings as sentences, those on intervals only where the values have some."""
        said = [f"these data say nothing of {name}: it has no effect on them" for name in self.insensitive]
        for one in self.confounded:
            fixed = f"; they fix {one.fixed}" if one.fixed else ""
            error = (
                "not at all" if one.relative_error > 1.0 else f"only to {100.0 * one.relative_error:.2g} %"
            )
            said.append(
                f"these data cannot tell {_join_names(one.names)} apart (each by itself {error}){fixed}; "
                "a start from rest, a ring-down, several tones or another amplitude would"
            )
        if with_intervals:
            said += [f"{name} is not significant: its interval holds zero" for name in self.insignificant]
        return tuple(said)


def assess_determinability(
    names: Sequence[str],
    values: FloatArray,
    information: FloatArray,
    covariance: FloatArray,
    scale: FloatArray,
) -> Determinability:
    """Assess which of the p parameters the data determine.

    Args:
        names: Names of the parameters.
        values: (p,) values in their units.
        information: (p, p) information per unit noise variance, by `values` / `scale`.
        covariance: (p, p) covariance of `values` / `scale`.
        scale: (p,) sizes of the parameters in their units.
    """
    diagonal = np.diag(information)
    silent = diagonal <= INSENSITIVE_RATIO * max(float(diagonal.max(initial=0.0)), 1e-300)
    kept = np.flatnonzero(~silent)
    relative = np.abs(values[kept] / scale[kept])
    errors = np.sqrt(np.diag(covariance))[kept]
    significant = relative > NORMAL_95 * errors
    size = np.where(significant, relative, np.maximum(relative, np.minimum(1.0, errors)))
    c = covariance[np.ix_(kept, kept)] / np.outer(size, size)
    own = _compute_conditional_errors(c)
    chosen = [names[k] for k in kept.tolist()]
    confounded = (np.sqrt(np.diag(c)) > VARIANCE_INFLATION * own) & (
        np.sqrt(np.diag(c)) > CONFOUNDED_RELATIVE_ERROR
    )
    found = _find_confounded_directions(chosen, c, confounded)
    eigenvalues = np.linalg.eigvalsh(c) if len(kept) else np.ones(1)
    in_doubt = {name for one in found for name in one.names}
    return Determinability(
        insensitive=tuple(names[k] for k in np.flatnonzero(silent).tolist()),
        confounded=found,
        insignificant=tuple(
            name for name, is_known in zip(chosen, significant, strict=True)
            if not is_known and name not in in_doubt
        ),
        condition=float(eigenvalues[-1] / max(float(eigenvalues[0]), 1e-300)),
    )  # fmt: skip


def _compute_conditional_errors(covariance: FloatArray) -> FloatArray:
    """Return the standard errors (p,) with all other parameters known."""
    found: FloatArray = 1.0 / np.sqrt(np.maximum(np.diag(np.linalg.pinv(covariance, rcond=1e-15)), 1e-300))
    return found


def _find_confounded_directions(
    names: Sequence[str], covariance: FloatArray, confounded: NDArray[np.bool_]
) -> tuple[ConfoundedDirection, ...]:
    """Return the confounded directions among the `confounded` parameters, the worst first."""
    if not confounded.any():
        return ()
    inside = np.flatnonzero(confounded)
    c = covariance[np.ix_(inside, inside)]
    eigenvalues, vectors = np.linalg.eigh(c)
    found = []
    for value, vector in zip(eigenvalues[::-1], vectors.T[::-1], strict=True):
        error = float(np.sqrt(max(value, 0.0)))
        if error < CONFOUNDED_RELATIVE_ERROR:
            break
        members = np.flatnonzero(np.abs(vector) > LEAST_SHARE * np.abs(vector).max())
        if len(members) < 2:
            continue
        group = tuple(names[inside[k]] for k in members)
        found.append(
            ConfoundedDirection(
                group, error, _describe_fixed_combination(group, vector[members], eigenvalues[0])
            )
        )
    return tuple(found)


def _describe_fixed_combination(names: Sequence[str], direction: FloatArray, least: float) -> str:
    """Name combinations that do not change along `direction`: products of powers, pair by pair."""
    said = []
    for (first, a), (second, b) in pairwise(zip(names, direction, strict=True)):
        power = -a / b
        if 0.05 < abs(power) < 20.0:
            word = "/" if power < 0.0 else " x "
            exponent = "" if abs(abs(power) - 1.0) < 0.05 else f"^{abs(power):.2g}"
            said.append(f"{first}{word}{second}{exponent}")
    error = f" to {100.0 * np.sqrt(max(least, 0.0)):.2g} %" if len(names) == 2 else ""
    return _join_names(said) + error if said else ""


def _join_names(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)
