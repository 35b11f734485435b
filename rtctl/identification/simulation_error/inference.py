"""From a minimum to values with standard errors: a sandwich of sensitivities and the residuals' colour.

    covariance = S^-1 (sum over records of J_p R J_p^T) S^-1,   J_p = J_shared - J_local T^-1 B

S is the information on the shared unknowns with the local ones (initial states) eliminated, R the residuals'
covariance by an autoregression fitted to them. H. White, Econometrica 48 (1980) 817, with a parametric middle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.identification.fit import Fit, FitError
from rtctl.identification.least_squares.arrowhead_solver import eliminate_local
from rtctl.identification.least_squares.determinability import assess_determinability
from rtctl.identification.least_squares.levenberg_marquardt import Minimum
from rtctl.identification.noise.residual_noise import NoiseModel, compute_coloured_gram, fit_noise_by_period
from rtctl.identification.simulation_error.segments import SegmentCost

LEAST_EIGENVALUE = 1e-15
"""Least information along any direction, relative to the largest: what no record shows has a large variance."""


def infer(method: str, cost: SegmentCost, found: Minimum) -> Fit:
    """Return the fit by `method` that ended at `found`, with its covariance and determinability."""
    sensitivity = cost.sensitivity
    residuals = _collect_residuals(cost, found)
    by_record = _group_by_record(cost, residuals)
    periods_s = [segment.record.period_s for segment in cost.segments]
    noise = {name: fit_noise_by_period(residuals[name], periods_s) for name in sensitivity.outputs}
    information, covariance = _compute_covariance(cost, found, noise)
    names = tuple(sensitivity.simulation.parameters[k].name for k in sensitivity.free)
    values = found.unknowns.shared * sensitivity.scale
    said = assess_determinability(names, values, information, covariance, sensitivity.scale)
    silent = np.array([name in said.insensitive for name in names], dtype=bool)
    covariance = covariance * np.outer(sensitivity.scale, sensitivity.scale)
    covariance[silent, :] = covariance[:, silent] = 0.0
    covariance[silent, silent] = np.inf
    initial = [cost.state(k, found.unknowns) for k in _find_first_segments(cost)]
    return Fit(
        simulation=sensitivity.simulation.with_values(sensitivity.values(found.unknowns.shared)),
        method=method, free=sensitivity.free, names=names, values=values, covariance=covariance,
        initial=np.array(initial), noise=noise,
        rms={name: _compute_rms(residuals[name]) for name in sensitivity.outputs},
        record_rms={
            record: {name: _compute_rms([residual]) for name, residual in outputs.items()}
            for record, outputs in by_record.items()
        },
        residuals=by_record,
        status=found.status, iterations=found.iterations, determinability=said,
        at_limit=sensitivity.find_at_limit(found.unknowns.shared),
        samples=sum(len(one) for series in residuals.values() for one in series),
    )  # fmt: skip


def _collect_residuals(cost: SegmentCost, found: Minimum) -> dict[str, list[FloatArray]]:
    """Return the residuals by output, one array a segment; raise FitError where the model diverges at the minimum."""
    residuals: dict[str, list[FloatArray]] = {name: [] for name in cost.sensitivity.outputs}
    for k in range(len(cost.segments)):
        run = cost.linearise(k, found.unknowns)
        if run is None:
            raise FitError("the model diverges where the fit ended: it is on the edge of its bounded motions")
        for row, name in enumerate(cost.sensitivity.outputs):
            residuals[name].append(run.residual[row, : -1 if cost.segments[k].joined else None])
    return residuals


def _group_by_record(
    cost: SegmentCost, residuals: dict[str, list[FloatArray]]
) -> dict[str, dict[str, FloatArray]]:
    """Concatenate the segments of each record."""
    names = [segment.record.name for segment in cost.segments]
    return {
        record: {
            output: np.concatenate([one for one, name in zip(series, names, strict=True) if name == record])
            for output, series in residuals.items()
        }
        for record in dict.fromkeys(names)
    }


def _compute_covariance(
    cost: SegmentCost, found: Minimum, noise: dict[str, NoiseModel]
) -> tuple[FloatArray, FloatArray]:
    """Return information per unit variance and covariance, both (p, p), of the scaled shared unknowns."""
    information, inner = eliminate_local(found.equations)
    middle = np.zeros_like(information)
    for k in range(len(cost.segments)):
        run = cost.linearise(k, found.unknowns)
        if run is None:
            continue  # `_collect_residuals` has raised for it
        for row, name in enumerate(cost.sensitivity.outputs):
            scored = slice(None, -1 if cost.segments[k].joined else None)
            slopes = run.shared[:, row, scored]
            if len(run.local):
                slopes = slopes - np.einsum("qp,qn->pn", inner[k], run.local[:, row, scored])
            middle += (
                compute_coloured_gram(slopes, noise[name].for_period(cost.segments[k].record.period_s))
                / cost.sigma[row] ** 4
            )
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    both = np.outer(scale, scale)
    sizes, axes = np.linalg.eigh(information * both)
    inverse = axes / np.maximum(sizes, LEAST_EIGENVALUE * sizes[-1:]) @ axes.T
    powers, directions = np.linalg.eigh(middle * both)
    root = inverse @ (directions * np.sqrt(np.maximum(powers, 0.0)))  # its square is no variance below zero
    covariance: FloatArray = root @ root.T * both
    return information, covariance


def _find_first_segments(cost: SegmentCost) -> NDArray[np.intp]:
    """Return the indices of the segments with which a record begins."""
    joined = np.array([False] + [segment.joined for segment in cost.segments[:-1]])
    return np.flatnonzero(~joined)


def _compute_rms(series: list[FloatArray]) -> float:
    count = sum(len(one) for one in series)
    return float(np.sqrt(sum(float(one @ one) for one in series) / count)) if count else 0.0
