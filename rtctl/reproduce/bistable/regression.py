"""Least squares, R^2, constraints and folds from Gram matrices, without the records themselves.

A model leaves y + d v + a z + b z^3 + g z^5 of a row, so with the vector m = (1, d, 0 .., a, b, g ..) over the columns
its squared error on a record is m G m, G the record's Gram matrix.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.identification.regression.streaming_gram import COLUMNS
from rtctl.reproduce.bistable.models import Beam

CUBIC = ("v", "z", "z^3")
QUINTIC = (*CUBIC, "z^5")


class Fit(NamedTuple):
    """A model over `COLUMNS`."""

    terms: tuple[str, ...]
    left: FloatArray
    """Residual vector (11,) of a row: 1 for y, each term's coefficient."""

    def coefficient(self, term: str) -> float:
        """Return the coefficient of a term on the side of the acceleration."""
        return float(self.left[COLUMNS.index(term)])

    @property
    def beam(self) -> Beam:
        """Return a beam's model; terms beyond the quintic are dropped."""
        return Beam(*(self.coefficient(term) for term in QUINTIC))


def of_beam(beam: Beam) -> Fit:
    """Return a beam's model over the columns."""
    left = np.zeros(len(COLUMNS))
    left[0] = 1.0
    for term, value in zip(QUINTIC, beam, strict=True):
        left[COLUMNS.index(term)] = value
    return Fit(QUINTIC, left)


def least_squares(gram: FloatArray, terms: Sequence[str]) -> Fit:
    """Fit `terms` on a Gram matrix (11, 11); columns are scaled before anything is solved."""
    chosen = [COLUMNS.index(term) for term in terms]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram)[chosen], 1e-300))
    inner = gram[np.ix_(chosen, chosen)] * scale[:, None] * scale
    left = np.zeros(len(COLUMNS))
    left[0] = 1.0
    left[chosen] = -scale * np.linalg.lstsq(inner, scale * gram[chosen, 0], rcond=1e-14)[0]
    return Fit(tuple(terms), left)


def constrained(gram: FloatArray, well_mm: float) -> Fit:
    """Fit the quintic whose force vanishes at the measured wells: the paper's equations (29) to (31)."""
    v, z, cube, fifth = (COLUMNS.index(term) for term in QUINTIC)
    basis = np.zeros((4, len(COLUMNS)))
    basis[0, 0] = basis[1, v] = basis[2, z] = basis[3, cube] = 1.0
    basis[2, fifth], basis[3, fifth] = -(well_mm**-4), -(well_mm**-2)
    reduced = basis @ gram @ basis.T
    scale = 1.0 / np.sqrt(np.diag(reduced)[1:])
    found = -scale * np.linalg.solve(reduced[1:, 1:] * scale[:, None] * scale, scale * reduced[1:, 0])
    return Fit(QUINTIC, np.concatenate(([1.0], found)) @ basis)


def squared_error(gram: FloatArray, fit: Fit) -> float:
    """Return the squared error summed over the rows of a Gram matrix."""
    return float(fit.left @ gram @ fit.left)


def determination(gram: FloatArray, fit: Fit) -> float:
    """Return R^2 of the paper's equation (19)."""
    one = COLUMNS.index("1")
    total = gram[0, 0] - gram[0, one] ** 2 / gram[one, one]
    return 1.0 - squared_error(gram, fit) / float(total)
