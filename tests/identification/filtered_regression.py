"""The beam paper's regression as published: a mean filter over 21 samples, central differences, least squares.

    z'' = - damping z' - stiffness z - stiffness_cubic z^3 + drive_gain u

What the weak form is compared with: the filter flattens the acceleration's peaks, where the higher terms show, and the
regression takes that for damping and for terms that are not there.

Reference: the bistable beam paper, sections 2.3 and 3.2.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.regression.mean_filter import NEIGHBOURS, apply_mean_filter
from rtctl.identification.regression.weak_form import TERMS, Sampled


def regress_filtered(
    records: Iterable[FitRecord], terms: Sequence[str], neighbours: int = NEIGHBOURS
) -> dict[str, float]:
    """Return the coefficients of `terms` over all records, which are read one at a time."""
    gram = np.zeros((1 + len(terms), 1 + len(terms)))
    for record in records:
        rows = np.stack(_build_columns(record, terms, neighbours))
        gram += rows @ rows.T
    scale = 1.0 / np.sqrt(np.diag(gram)[1:])
    found = scale * np.linalg.solve(gram[1:, 1:] * np.outer(scale, scale), scale * gram[1:, 0])
    return dict(zip(terms, found.tolist(), strict=True))


def _build_columns(record: FitRecord, terms: Sequence[str], neighbours: int) -> list[FloatArray]:
    """Return acceleration and terms, (n - 2 neighbours - 4,) each."""
    z = apply_mean_filter(record.measured["displacement"], neighbours)
    inner = slice(neighbours, record.samples - neighbours)
    drive = record.stimulus.inputs.get("drive")
    u = np.zeros_like(z) if drive is None else drive[inner]
    v = _differentiate(z, record.period_s)
    signals = Sampled(z[2:-2], v[1:-1], u[2:-2], 0.0)
    columns = [_differentiate(v, record.period_s)]
    for term in (TERMS[name] for name in terms):
        wide = signals._replace(z=z[1:-1], v=v, u=u[1:-1])
        force = _differentiate(term.feature(wide), record.period_s) if term.order else term.feature(signals)
        columns.append(term.sign * force)
    return columns


def _differentiate(signal: FloatArray, period_s: float) -> FloatArray:
    """Return the central difference (n - 2,)."""
    slope: FloatArray = (signal[2:] - signal[:-2]) / (2.0 * period_s)
    return slope
