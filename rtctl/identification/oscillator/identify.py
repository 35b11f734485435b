"""Identify an oscillator: weak-form starts, output error or multiple shooting, values with intervals."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from math import inf
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.border.model_file import ModelFile
from rtctl.border.motion import with_displacement
from rtctl.border.simulation import Simulation
from rtctl.identification.fit import Fit, FitError
from rtctl.identification.fit_record import FitRecord, select_fit_records
from rtctl.identification.hold_comparison import HoldDoubt, compare_holds
from rtctl.identification.oscillator.refit import make_refit
from rtctl.identification.oscillator.standing_reading import (
    BETTER,
    DISPLACEMENT,
    describe_either,
    describe_taken,
    find_standing_reading,
    with_sensor_offset,
)
from rtctl.identification.oscillator.start_values import Starts, generate_starts
from rtctl.identification.oscillator.writing import (
    KIND,
    Build,
    collect_warnings,
    make_nominal_model,
    write_model,
)
from rtctl.identification.regression.weak_form import WeakFit
from rtctl.identification.residual_words import NO_INTERVALS, lacks_something
from rtctl.identification.simulation_error.multiple_shooting import ShootingOptions, fit_multiple_shooting
from rtctl.identification.simulation_error.output_error import (
    MultiStartOptions,
    ReportProgress,
    fit_output_error,
)
from rtctl.identification.simulation_error.trajectory_divergence import measure_divergence
from rtctl.measured.dataset import Dataset

MAX_RESIDUAL_SHARE = 0.3
"""RMS residual relative to the motion above which a fit is not trusted.

A free run in the wrong well or out of step is off by more.
"""
LEAST_SAMPLES_PER_UNKNOWN = 10
"""Scored samples for each unknown (parameters, and two numbers of each record's start) below which nothing is fitted.

Fewer leave no residual from which noise and standard errors could be estimated.
"""
NOT_TRUSTED = (
    "do not use this model, because {left}. A diagnosis (rtctl diagnose) fits again and names what the equation "
    "lacks, such as a delay or friction. If it names nothing, give a start model (--model) with better "
    "values; check the sample rate and the units, and that drive and response are not swapped and belong together"
)
UNDRIVEN = (
    "the drive is constant in all fitted records, so nothing shows the gain from it to the motion: drive_gain is left "
    "out of the model; add a record with a drive that varies"
)
TRENDING_DRIVE = 0.5
"""Variation of a drive about a straight line over its whole variation, below which its record is a slow ramp."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OscillatorFitOptions(MultiStartOptions):
    """Options of the identification."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OscillatorFit:
    """A model file and the fit behind it."""

    model: ModelFile
    """Model file without provenance."""
    fit: Fit
    weak: WeakFit | None
    """Start values of records in time; None: the records are sweeps."""
    reason: str
    """Why the method was chosen."""
    warnings: tuple[str, ...]
    records: tuple[FitRecord, ...]
    """The fitted records."""
    trusted: bool = True
    """Whether the fit follows the data at all; if not, standard errors of its parameters mean nothing."""
    correction: str = ""
    """What to write in the manifest before anything else; "": nothing."""


def identify_oscillator(
    dataset: Dataset,
    model: ModelFile | None,
    build: Build,
    options: OscillatorFitOptions | None = None,
    *,
    source: str = "model",
    report: ReportProgress = lambda text, share: None,
) -> OscillatorFit:
    """Fit the parameters of `model` that are not fixed, or the nominal four without a model.

    Args:
        dataset: Oscillator dataset.
        model: Start model, or None.
        build: Binds a model to units (`rtctl.wiring_models.build_simulation`).
        options: Numbers of starts and iterations.
        source: Name of the start model in messages.
        report: Receives the progress.

    Raises:
        InputError: There is nothing to fit.
        FitError: No start leads to a bounded simulation.
    """
    options = options or OscillatorFitOptions()
    records = select_usable_records(dataset)
    undriven = model is None and _is_undriven(records)
    start = model or make_nominal_model(build, dataset.units, without=("drive_gain",) if undriven else ())
    fitting = _Fitting(records, dataset, build, options, source, report)
    taken, noted = fitting.from_zero(start) if model is None else (fitting.of(start, trust_own=True), "")
    start, fit, starts = taken.start, taken.fit, taken.starts
    doubt = _describe_doubt(_compute_residual_share(fit, records, without_mean=True), taken.free_share)
    lacking = not doubt and _lacks_something(fit, records)
    held = HoldDoubt()
    if not (doubt or _is_undriven(records)):
        report("comparing holds of the drive", 1.0)
        compared, refit = make_refit(fit, records, options.fit)
        held = compare_holds(fit, compared, refit, dataset.path)
    return OscillatorFit(
        model=write_model(start, fit, with_errors=not (doubt or lacking)),
        trusted=not doubt,
        fit=fit,
        weak=starts.weak,
        reason=taken.reason,
        warnings=(
            *((NOT_TRUSTED.format(left=doubt),) if doubt else ()),
            *((NO_INTERVALS.format(left=100.0 * _compute_residual_share(fit, records)),) if lacking else ()),
            *((UNDRIVEN,) if undriven else ()),
            *((noted,) if noted else ()),
            *((held.text,) if held.text else ()),
            *collect_warnings(fit, with_displacement(dataset.units), with_errors=not (doubt or lacking)),
        ),
        records=records,
        correction=held.correction,
    )


class _Taken(NamedTuple):
    """A fit from a start model."""

    start: ModelFile
    starts: Starts
    fit: Fit
    reason: str
    """Why its method was chosen."""
    free_share: float
    """What free runs leave of the motion, of a fit by segments; else NaN."""


class _Fitting(NamedTuple):
    """What every fit of one identification shares."""

    records: tuple[FitRecord, ...]
    dataset: Dataset
    build: Build
    options: OscillatorFitOptions
    source: str
    report: ReportProgress

    def of(self, start: ModelFile, *, trust_own: bool = False) -> _Taken:
        """Fit what is free in a start model. Raises InputError where nothing is, or samples are too few for it."""
        simulation = self.build(start, self.dataset.units, self.source)
        if all(parameter.fixed for parameter in simulation.parameters):
            raise InputError(f"{self.source}: every parameter is fixed or missing: there is nothing to fit")
        _check_number_of_samples(self.dataset, self.records, simulation)
        self.report("start values", 0.0)
        options = self.options
        starts = generate_starts(simulation, self.records, options.starts, options.seed, trust_own=trust_own)
        return _Taken(
            start, starts, *_fit_by_suitable_method(simulation, self.records, starts, options, self.report)
        )

    def from_zero(self, start: ModelFile) -> tuple[_Taken, str]:
        """Fit the nominal model, also with a sensor whose zero is elsewhere if it reads far from zero; and a note."""
        standing = find_standing_reading(self.records)
        if standing is None:
            return self.of(start), ""
        unit = self.dataset.units[DISPLACEMENT]
        try:
            shifted = self.of(with_sensor_offset(start, standing[0], unit))
        except (FitError, InputError):
            return self.of(start), ""
        left = _compute_residual_share(shifted.fit, self.records)
        try:
            well = self.of(start)
        except FitError:
            return shifted, describe_taken(standing, unit, left, inf)
        left_in_well = _compute_residual_share(well.fit, self.records)
        if not left < BETTER * left_in_well:
            return well, describe_either(standing, unit, left, left_in_well)
        return shifted, describe_taken(standing, unit, left, left_in_well)


def _describe_doubt(left: float, free_share: float) -> str:
    """Return why a fit is not trusted; "": it is.

    Args:
        left: RMS residual of the fit relative to the motion.
        free_share: The same of free runs with the fitted values; NaN where a free run is not predictable.
    """
    if left > MAX_RESIDUAL_SHARE:
        return f"it leaves {100.0 * left:.3g} % of the motion"
    if free_share > MAX_RESIDUAL_SHARE:
        return (
            f"it follows short segments only: free runs over whole records leave {100.0 * free_share:.3g} % of the "
            "motion, though the motion is predictable"
        )
    return ""


def _check_number_of_samples(
    dataset: Dataset, records: tuple[FitRecord, ...], simulation: Simulation
) -> None:
    """Raise InputError where the records have too few samples for the unknowns of the fit."""
    free = sum(not one.fixed for one in simulation.parameters)
    unknowns = free + 2 * len(records)
    samples = sum(record.samples - record.first for record in records)
    if samples < LEAST_SAMPLES_PER_UNKNOWN * unknowns:
        raise InputError(
            f"{dataset.path}: the records to fit have {samples} scored samples for {unknowns} unknowns ({free} "
            f"parameters, and the start of each record); at least {LEAST_SAMPLES_PER_UNKNOWN * unknowns} are needed"
        )


def _is_undriven(records: tuple[FitRecord, ...]) -> bool:
    """Whether no input varies in any record."""
    return all(not np.ptp(values) for record in records for values in record.stimulus.inputs.values())


def _fit_by_suitable_method(
    simulation: Simulation,
    records: tuple[FitRecord, ...],
    found: Starts,
    options: OscillatorFitOptions,
    report: ReportProgress,
) -> tuple[Fit, str, float]:
    """Fit by the method that the data allow.

    Returns:
        The fit, why its method was chosen, and, of a fit by segments, what free runs with its values leave of the
        motion (RMS share; NaN where the motion is not predictable, and of other fits).
    """
    shooting = ShootingOptions(most_left=MAX_RESIDUAL_SHARE, fit=options.fit)
    starts, linear_share = found.values, found.linear_share
    parts = measure_divergence(simulation, records, starts[0])
    if parts.is_chaotic and linear_share > MAX_RESIDUAL_SHARE:
        reason = (
            f"fitted in short segments, as no long free run of record {parts.record} can be predicted: a small "
            f"difference of the start grows by e every {1.0 / parts.rate:.2g} s"
        )
        with suppress(FitError):  # from bounded starts a free run may go
            fit = fit_multiple_shooting(simulation, records, shooting, starts=starts, report=report)
            return fit, reason, _compute_free_share(fit, records, options)
    free_run = fit_output_error(simulation, records, options.fit, starts=starts, report=report)
    left = _compute_residual_share(free_run, records)
    if left <= MAX_RESIDUAL_SHARE:
        return free_run, f"free runs leave {100.0 * left:.2g} % of the motion", np.nan
    short = None
    with suppress(FitError):  # the free run's values stand where no segment can be fitted
        short = fit_multiple_shooting(simulation, records, shooting, starts=starts, report=report)
    follows = np.inf if short is None else _compute_residual_share(short, records)
    if short is not None and follows < 0.5 * left:
        reason = (
            f"fitted in segments of a period, which leave {100.0 * follows:.2g} % of the motion: free runs "
            f"over whole records leave {100.0 * left:.2g} % (they end in another "
            "well, or the start model is too far off)"
        )
        return short, reason, _compute_free_share(short, records, options)
    return (
        free_run,
        f"neither free runs nor segments follow the data ({100.0 * left:.2g} % of the motion is left)",
        np.nan,
    )


def _compute_free_share(fit: Fit, records: tuple[FitRecord, ...], options: OscillatorFitOptions) -> float:
    """Return what free runs with the values of a fit by segments leave of the motion, each start fitted.

    NaN where neighbouring trajectories diverge exponentially at these values: then a free run says nothing. Of a model
    that runs away it says something unless the segments leave noise: then the plant is unstable, and feedback holds it.
    """
    values = np.array([one.value for one in fit.simulation.parameters])
    parts = measure_divergence(fit.simulation, records, values)
    if parts.is_chaotic and not (parts.runs_away and _lacks_something(fit, records)):
        return float("nan")
    try:
        free = fit_output_error(fit.simulation, records, options.fit, starts=[values], free=())
    except FitError:
        return float("inf")
    return _compute_residual_share(free, records, without_mean=True)


def _lacks_something(fit: Fit, records: tuple[FitRecord, ...]) -> bool:
    """Return whether what a fit leaves is neither small nor like noise."""
    output = next(iter(fit.rms))
    left = [outputs[output] for outputs in fit.residuals.values()]
    return lacks_something(_compute_residual_share(fit, records), left)


def _compute_residual_share(fit: Fit, records: tuple[FitRecord, ...], *, without_mean: bool = False) -> float:
    """Return the RMS residual of the displacement relative to its motion: about its drift, else about its mean.

    `without_mean` removes each record's mean residual first: a constant has a simple cause, which is reported apart.
    """
    output = next(iter(fit.rms))
    whole = np.concatenate([one.measured[output][one.first :] for one in records])
    about_drift = np.concatenate([_remove_drift(one, output) for one in records])
    motion = float(min(np.std(whole), np.sqrt(np.mean(about_drift**2)))) or float(np.std(whole))
    if not without_mean:
        return fit.rms[output] / motion
    left = [outputs[output] - np.mean(outputs[output]) for outputs in fit.residuals.values()]
    return float(np.sqrt(np.mean(np.concatenate(left) ** 2))) / motion


def _remove_drift(record: FitRecord, output: str) -> FloatArray:
    """Return an output from the first scored sample on, about a straight line if the drive follows none, else its mean.

    A drift of the sensor is no motion, and a model that follows only that follows nothing.
    """
    values = record.measured[output][record.first :]
    time = np.linspace(-1.0, 1.0, len(values))

    def about_line(x: FloatArray) -> FloatArray:
        about_mean = x - x.mean()
        line: FloatArray = about_mean - time * (time @ about_mean) / (time @ time)
        return line

    for drive in record.stimulus.inputs.values():
        shown = drive[record.first :]
        if np.std(about_line(shown)) < TRENDING_DRIVE * np.std(shown):
            return np.asarray(values - values.mean())
    return about_line(values)


def select_usable_records(dataset: Dataset) -> tuple[FitRecord, ...]:
    """Return the records to fit. Raises InputError where there is none, or nothing moves in one."""
    if dataset.plant != KIND:
        raise InputError(
            f'{dataset.path}: key "dataset.plant" is "{dataset.plant}", --kind {KIND} needs "{KIND}"'
        )
    records = select_fit_records(dataset)
    if not records:
        raise InputError(f'{dataset.path}: no record has use = "fit"; test records are never fitted')
    for record in records:
        if not any(np.ptp(values[record.first :]) for values in record.measured.values()):
            raise InputError(
                f"{dataset.path}: record {record.name}: nothing moves, all outputs are constant; leave the record out, "
                "or correct its column"
            )
    return records
