"""Identify a `Vo2Model`: read-outs from staircases, the time constant of the heating from transients.

The read-outs are fitted to the ends of the holds (v = current there), each baseline of the paper on the same data.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr
from threadpoolctl import threadpool_limits

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.border.options import LARGEST_SEED, check_integer
from rtctl.hysteresis.egpi import EgpiModel
from rtctl.hysteresis.gap_free import GapFreeModel
from rtctl.hysteresis.gpi import GpiModel
from rtctl.hysteresis.gpi_inverse import GpiInverse
from rtctl.identification.vo2.cross_validation import cross_validate
from rtctl.identification.vo2.heating import TimeConstant, find_time_constant
from rtctl.identification.vo2.play_fit import PlayFit, PlayProblem, fit_plays, spread_starts
from rtctl.identification.vo2.preisach_fit import PreisachFit, fit_preisach
from rtctl.identification.vo2.staircase import SteadyStates, extract_steady_states, simulate_hold_ends
from rtctl.measured.dataset import Dataset
from rtctl.models.span import Span
from rtctl.models.vo2 import NOMINAL_TIME_CONSTANT_S, FitQuality, Vo2Model

Report = Callable[[str], None]
COARSE_CELLS = 24  # enough for the time constant
PAPER_SMOOTHNESS = 1e-4  # of the paper's few levels, which need none
MIN_LN_CHANGE = 0.05  # of resistance; a VO2 film's is 2 and more
FALLING = -0.5
"""Rank correlation of the deflection with -ln R, below which the deflection is counted against the heating."""
FALLS = (
    "{}: the deflection falls while the film heats, and these models have one that grows. Write scale = -1 in "
    "[signals.deflection] of the manifest, or turn the sign at the instrument; setpoints count in that direction then"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Vo2FitOptions:
    """Options of the identification."""

    plays: int = 6
    starts: int = 14
    fine_cells: int = 80
    paper_levels: int = 10
    seed: int = 0

    def __post_init__(self) -> None:
        check_integer("plays", self.plays, 1, 64, "play operators")
        check_integer("starts", self.starts, 1, 64, "starts of each fit")
        check_integer("cells", self.fine_cells, 8, 80, "cells along an edge of the fine Preisach models")
        check_integer("seed", self.seed, 0, LARGEST_SEED)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Data:
    """The samples in the forms that the fits take; `u` is -ln R."""

    v: FloatArray
    u: FloatArray
    deflection: FloatArray
    scored: NDArray[np.bool_]
    deflection_scored: NDArray[np.bool_]
    ends: SteadyStates


def identify_vo2(dataset: Dataset, options: Vo2FitOptions, report: Report) -> Vo2Model:
    """Identify all parts of the model.

    Args:
        dataset: Dataset with at least one staircase.
        options: Numbers of plays, starts and cells.
        report: Receives the name of each stage.

    Raises:
        InputError: The data are not sufficient.
    """
    with threadpool_limits(1, "blas"):  # on small matrices threads cost thirty times what they give
        return _identify(dataset, options, report)


class _ReadOuts(NamedTuple):
    """Read-outs that are fitted to the settled holds alone."""

    gpi: GpiModel
    behind_gpi: EgpiModel
    gap_free: GapFreeModel
    behind_gap_free: EgpiModel
    egpi: EgpiModel
    direct_egpi: EgpiModel
    residuals: Mapping[str, FloatArray]
    """By the name that `Vo2Model.quality` has, in the unit of `_QUALITY_UNITS`."""


_QUALITY_UNITS = {
    "resistance_gpi": "kohm", "composite": "um", "gap_free_composite": "um", "resistance_gap_free": "ln ohm",
    "resistance_preisach": "ln ohm", "deflection_egpi": "um", "deflection_preisach": "um", "direct_preisach": "um",
    "direct_egpi": "um",
}  # fmt: skip
"""Unit of each read-out's residual."""


def _fit_read_outs(data: _Data, options: Vo2FitOptions, report: Report) -> _ReadOuts:
    """Fit the play models: of the resistance, of the deflection behind their inverses, and without them."""
    report("resistance: GPI with an analytic inverse")
    gpi, gpi_error = _fit_gpi(data, options)
    report("deflection: EGPI behind the inverse GPI")
    behind_gpi, composite_error = _fit_egpi(
        compute_surrogate(data, GpiInverse.of(gpi).estimate, -1e-3), data, options
    )
    report("resistance: gap-free, and EGPI behind its inverse")
    gap_free, gap_free_error = _fit_gap_free(data, options)
    behind_gap_free, gap_free_composite_error = _fit_egpi(
        compute_surrogate(data, gap_free.invert, None), data, options
    )
    report("deflection: EGPI on the current itself")
    egpi, egpi_error = _fit_egpi(data.v, data, options)
    report("baseline: EGPI on resistance")
    direct_egpi, direct_error = _fit_egpi(data.u, data, options)
    residuals = {
        "resistance_gpi": gpi_error, "composite": composite_error, "gap_free_composite": gap_free_composite_error,
        "resistance_gap_free": gap_free_error, "deflection_egpi": egpi_error, "direct_egpi": direct_error,
    }  # fmt: skip
    return _ReadOuts(gpi, behind_gpi, gap_free, behind_gap_free, egpi, direct_egpi, residuals)


def _identify(dataset: Dataset, options: Vo2FitOptions, report: Report) -> Vo2Model:
    data = _prepare_data(dataset)
    plays = _fit_read_outs(data, options, report)
    report("Preisach models and the time constant of the heating")
    direct_d = fit_preisach(
        data.u, data.deflection, data.deflection_scored, cells=options.paper_levels, uniform_share=1.0,
        smoothness=PAPER_SMOOTHNESS,
        memoryless=(True, False),
    )  # fmt: skip
    fine = _fit_fine_and_heating(dataset, data, options)
    fine_r, fine_d, tau = fine.resistance, fine.deflection, fine.time_constant
    if tau is None:
        report(
            "the heating's time constant cannot be seen in these data: no record has enough samples in the time that "
            f"the film takes to settle. The model has the nominal {1e3 * NOMINAL_TIME_CONSTANT_S:g} ms, without an "
            "interval; add a record that is sampled faster, such as of steps"
        )
    resistance = _make_span(np.exp(-data.u[data.scored]))
    deflection = _make_span(data.deflection[data.deflection_scored])
    ranges = {
        "kohm": 1e-3 * resistance.width,
        "um": deflection.width,
        "ln ohm": float(np.ptp(data.u[data.scored])),
    }
    residuals = {
        **plays.residuals, "resistance_preisach": fine_r.residual, "deflection_preisach": fine_d.residual,
        "direct_preisach": direct_d.residual,
    }  # fmt: skip
    return Vo2Model(
        identity=dataset.identity,
        time_constant_s=tau.value_s if tau else NOMINAL_TIME_CONSTANT_S,
        time_constant_error_s=tau.standard_error_s if tau else float("inf"),
        current=_make_span(data.v[data.scored]),
        resistance=resistance,
        deflection=deflection,
        reading_error=float(np.std(fine_r.residual)),
        deflection_error=float(np.std(fine_d.residual)),
        timing_skew_rows=float(tau.reads_after) if tau else 0.0,
        reading_error_elsewhere=fine.reading_error_elsewhere,
        deflection_error_elsewhere=fine.deflection_error_elsewhere,
        resistance_gpi=plays.gpi,
        composite_egpi=plays.behind_gpi,
        resistance_gap_free=plays.gap_free,
        gap_free_egpi=plays.behind_gap_free,
        deflection_egpi=plays.egpi,
        resistance_preisach=fine_r.model,
        deflection_preisach=fine_d.model,
        direct_preisach=direct_d.model,
        direct_egpi=plays.direct_egpi,
        quality={
            name: compute_quality(residuals[name], unit, ranges[unit])
            for name, unit in _QUALITY_UNITS.items()
        },
    )


class _Fine(NamedTuple):
    """Read-outs on a fine grid, the heating, and what the read-outs miss elsewhere."""

    resistance: PreisachFit
    deflection: PreisachFit
    time_constant: TimeConstant | None
    reading_error_elsewhere: float | None
    deflection_error_elsewhere: float | None


def _fit_fine_and_heating(dataset: Dataset, data: _Data, options: Vo2FitOptions) -> _Fine:
    """Fit fine read-outs and tau in turns: tau tells how far from rest the holds were, the read-outs explain the rest.

    The first turns use fewer cells, which determine tau nearly as well.
    """
    records = [record for record in dataset.records if record.use != "test"]
    v, tau = data.v, None
    coarse = min(COARSE_CELLS, options.fine_cells)
    near_r, near_d = None, None
    for cells in (coarse, coarse, options.fine_cells):
        fine_r = fit_preisach(v, data.u, data.scored, cells=cells, near=near_r)
        fine_d = fit_preisach(v, data.deflection, data.deflection_scored, cells=cells, near=near_d)
        near_r, near_d = fine_r.model, fine_d.model
        tau = find_time_constant(records, fine_r.model, fine_d.model, NOMINAL_TIME_CONSTANT_S)
        if tau is not None:
            v = simulate_hold_ends(dataset, tau.value_s, reads_after=tau.reads_after)
    return _Fine(fine_r, fine_d, tau, *_predict_elsewhere(v, data))


def _predict_elsewhere(v: FloatArray, data: _Data) -> tuple[float | None, float | None]:
    """Return the RMS errors of ln R and of the deflection [um] on swings that took no part in a fit."""
    reading = cross_validate(v, data.u, data.scored)
    return reading, cross_validate(v, data.deflection, data.deflection_scored)


def _prepare_data(dataset: Dataset) -> _Data:
    if dataset.plant != "vo2":
        raise InputError(f'{dataset.path}: dataset.plant is "{dataset.plant}", --kind vo2 needs "vo2"')
    _refuse_impossible(dataset)
    ends = extract_steady_states(dataset)
    has_deflection = ends.scored & np.isfinite(ends.deflection_um)
    if has_deflection.sum() < 100:
        raise InputError(
            f"{dataset.path}: {int(has_deflection.sum())} steady states with deflection; identification needs the "
            "external instrument once (at least 100)"
        )
    u = -np.log(ends.resistance_ohm)
    low, width = float(u[ends.scored].min()), float(np.ptp(u[ends.scored]))
    if not width > MIN_LN_CHANGE:
        raise InputError(
            f"{dataset.path}: resistance changes by {100.0 * np.expm1(width):.2g} % over the staircases: that is no "
            "transition; check the range of the current and the resistance channel"
        )
    if not np.ptp(ends.deflection_um[has_deflection]) > 0.0:
        raise InputError(f"{dataset.path}: deflection never changes; check the external instrument's channel")
    if float(spearmanr(u[has_deflection], ends.deflection_um[has_deflection]).statistic) < FALLING:
        raise InputError(FALLS.format(dataset.path))
    u = np.where(ends.reset, low - width, u)  # the reset samples reset models of u as well
    return _Data(
        v=ends.current_mA,
        u=u,
        deflection=np.nan_to_num(ends.deflection_um),
        scored=ends.scored,
        deflection_scored=has_deflection,
        ends=ends,
    )


def _refuse_impossible(dataset: Dataset) -> None:
    """Raise InputError for a current below 0 or a resistance without a logarithm in a record that the fits use."""
    found = []
    for record in (record for record in dataset.records if record.use != "test"):
        for name, unit, bound in (("current", "mA", ">= 0"), ("resistance", "ohm", "> 0")):
            values = record.signals[name]
            bad = ~(values > 0.0 if bound == "> 0" else values >= 0.0)
            if bad.any():
                first = int(bad.argmax())
                found.append(
                    f"{dataset.path}: record {record.file or record.name}: {name} is {values[first]:g} {unit} at "
                    f"sample {first}, {bad.sum()} of {len(bad)} samples are not {bound}; correct its sign or its "
                    'unit, or give the record use = "test"'
                )
    if found:
        raise InputError("\n".join(found))


def compute_surrogate(
    data: _Data,
    invert: Callable[[FloatArray], tuple[FloatArray, FloatArray, Any]],
    resistance_scale: float | None,
) -> FloatArray:
    """Return the surrogate (n,) that an inverse gives for the measured resistance, each staircase from a full cooling.

    The deflection model behind an inverse is identified on what that inverse really gives, gaps and saturation
    included,
    so that the cascade is right as a whole where its first half alone is not (the paper fits both halves to the
    current).

    Args:
        data: Samples of the staircases.
        invert: Inverse of a resistance model.
        resistance_scale: Factor of R in the inverse's input; None: it takes -ln R.
    """
    low, high = data.v[data.scored].min(), data.v[data.scored].max()
    margin = 0.1 * (high - low)
    reading = data.u if resistance_scale is None else resistance_scale * np.exp(-data.u)
    starts = np.flatnonzero(data.ends.reset)
    surrogate = np.zeros(len(data.v))
    for first, last in zip(starts, np.append(starts[1:], len(data.v)), strict=True):
        found = invert(np.ascontiguousarray(reading[first + 1 : last]))[0]
        surrogate[first + 1 : last] = np.clip(found, low - margin, high + margin)
    return surrogate


def _space_radii(count: int) -> FloatArray:
    return np.arange(count) / count  # the paper's (i - 1) / 6


def _fit_gpi(data: _Data, options: Vo2FitOptions) -> tuple[GpiModel, FloatArray]:
    y = -1e-3 * np.exp(-data.u)
    problem = PlayProblem(
        v=data.v,
        y=y,
        scored=data.scored,
        radii=_space_radii(options.plays),
        common=True,
        free=np.ones((len(data.v), 1)),
        nonnegative=np.empty((len(data.v), 0)),
        least_first_weight=0.02 * float(np.ptp(y[data.scored])),
    )
    fit = fit_plays(problem, spread_starts(problem, options.starts, options.seed), evaluations=100)
    low, high = problem.range
    model = GpiModel(
        p=fit.weights,
        r=problem.radii,
        a_R=float(fit.envelopes.a_R[0]),
        b_R=float(fit.envelopes.b_R[0]),
        a_L=float(fit.envelopes.a_L[0]),
        b_L=float(fit.envelopes.b_L[0]),
        c=float(fit.free[0]),
        v_low=low,
        v_high=high,
    )
    return model, fit.residual


def _fit_gap_free(data: _Data, options: Vo2FitOptions) -> tuple[GapFreeModel, FloatArray]:
    least_slope = 0.01 * float(np.ptp(data.u[data.scored])) / float(np.ptp(data.v[data.scored]))
    problem = PlayProblem(
        v=data.v,
        y=data.u - least_slope * data.v,
        scored=data.scored,
        radii=_space_radii(options.plays),
        common=False,
        free=np.ones((len(data.v), 1)),
        nonnegative=np.stack((data.v, data.v**2), axis=1),
    )
    fit = fit_plays(problem, spread_starts(problem, options.starts, options.seed), evaluations=80)
    low, high = problem.range
    model = GapFreeModel(
        **_collect_play_fields(fit, problem),
        q1=float(fit.nonnegative[0]) + least_slope,
        q2=float(fit.nonnegative[1]),
        c=float(fit.free[0]),
        v_low=low,
        v_high=high,
    )
    return model, fit.residual


def _fit_egpi(v: FloatArray, data: _Data, options: Vo2FitOptions) -> tuple[EgpiModel, FloatArray]:
    problem = PlayProblem(
        v=v,
        y=data.deflection,
        scored=data.deflection_scored,
        radii=_space_radii(options.plays),
        common=False,
        free=np.stack((np.ones_like(v), v), axis=1),
        nonnegative=np.empty((len(v), 0)),
    )
    fit = fit_plays(problem, spread_starts(problem, options.starts, options.seed), evaluations=80)
    low, high = problem.range
    model = EgpiModel(
        **_collect_play_fields(fit, problem),
        c3=float(fit.free[0]),
        c2=float(fit.free[1]),
        v_low=low,
        v_high=high,
    )
    return model, fit.residual


def _collect_play_fields(fit: PlayFit, problem: PlayProblem) -> dict[str, Any]:
    return {"p": fit.weights, "r": problem.radii, **fit.envelopes._asdict()}


def _make_span(values: FloatArray) -> Span:
    return Span(float(values.min()), float(values.max()))


def compute_quality(residual: FloatArray, unit: str, width: float) -> FitQuality:
    """Return the error measures of a read-out's residual (n,) [unit] whose output has the range `width` [unit]."""
    error = np.abs(residual)
    return FitQuality(
        mean_abs=float(error.mean()),
        max_abs=float(error.max()),
        rms=float(np.sqrt(np.mean(residual**2))),
        unit=unit,
        range=width,
    )
