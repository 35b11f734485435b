"""Start values for oscillator fits: the model's own, a linear oscillator, the weak form's, and random ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.oscillator.linear_start import fit_linear
from rtctl.identification.regression.weak_form import TERMS, WeakFit, choose_half_width, regress
from rtctl.identification.scales import compute_parameter_scales, estimate_scales

WIDTHS = (1.0, 1.6)
SPREAD = 0.15
"""Standard deviation of a random start's logarithm; ten times that for a shape, of which nothing is known."""


class Starts(NamedTuple):
    """Full parameter vectors (parameters,), the most promising first."""

    values: list[FloatArray]
    weak: WeakFit
    linear_share: float
    """What free runs of the linear oscillator leave of the motion (RMS); infinite where there is none."""


def generate_starts(
    simulation: Simulation, records: Sequence[FitRecord], count: int, seed: int, *, trust_own: bool
) -> Starts:
    """Return at least one start.

    Args:
        simulation: Model with its own values.
        records: Records for the regressions.
        count: Number of starts.
        seed: Seed of the random starts.
        trust_own: Whether the simulation's own values are an estimate, and not zeros.
    """
    own = np.array([parameter.value for parameter in simulation.parameters])
    scales = estimate_scales(records)
    width_s = choose_half_width(records, scales.rate)
    regressions = [_regress_free_terms(simulation, records, factor * width_s) for factor in WIDTHS]
    found = [_fill_in(simulation, own, weak) for weak in regressions]
    linear = _fit_linear_terms(simulation, own, records)
    if linear is not None:
        found.insert(1, linear.values)
    if trust_own:
        found.insert(1, own)
    draw = np.random.default_rng(seed)
    sizes = compute_parameter_scales(simulation.parameters, scales)
    while len(found) < count:
        found.append(_perturb(simulation, found[0], sizes, draw))
    share = linear.residual_share if linear is not None else np.inf
    return Starts(found[: max(count, 1)], regressions[0], share)


class _LinearStart(NamedTuple):
    values: FloatArray
    residual_share: float


def _fit_linear_terms(
    simulation: Simulation, own: FloatArray, records: Sequence[FitRecord]
) -> _LinearStart | None:
    """Return `own` with the linear terms of the best linear oscillator; None where one of them is known, or missing."""
    place = {one.name: k for k, one in enumerate(simulation.parameters) if not one.fixed}
    if not place.keys() >= {"damping", "stiffness", "drive_gain"}:
        return None
    fit = fit_linear(records)
    if fit is None:
        return None
    values = own.copy()
    for name in ("damping", "stiffness", "drive_gain"):
        parameter = simulation.parameters[place[name]]
        values[place[name]] = np.clip(getattr(fit, name), parameter.low, parameter.high)
    return _LinearStart(values, fit.residual_share)


def _regress_free_terms(simulation: Simulation, records: Sequence[FitRecord], width_s: float) -> WeakFit:
    """Regress all free parameters that are terms of the weak form; those that are fixed are known."""
    terms = [one.name for one in simulation.parameters if one.name in TERMS and not one.fixed]
    known = {
        one.name: one.value
        for one in simulation.parameters
        if one.name in TERMS and one.fixed and one.value != 0.0
    }
    return regress(records, [*terms, "offset"], width_s, known)


def _fill_in(simulation: Simulation, own: FloatArray, weak: WeakFit) -> FloatArray:
    """Return `own` with the regressed coefficients, within bounds."""
    values = own.copy()
    for k, parameter in enumerate(simulation.parameters):
        if parameter.name in weak.coefficients and not parameter.fixed:
            values[k] = np.clip(weak.coefficients[parameter.name], parameter.low, parameter.high)
    return values


def _perturb(
    simulation: Simulation, values: FloatArray, scale: FloatArray, draw: np.random.Generator
) -> FloatArray:
    """Draw free values around `values`; signs stay, and a zero moves by a share of its scale."""
    moved = values.copy()
    for k, parameter in enumerate(simulation.parameters):
        if parameter.fixed:
            continue
        spread = SPREAD * (10.0 if parameter.declared.is_shape else 1.0)
        jump = draw.standard_normal()
        value = values[k] * np.exp(spread * jump) if values[k] != 0.0 else 0.01 * spread * jump * scale[k]
        moved[k] = np.clip(value, parameter.low, parameter.high)
    return moved
