"""Identify an oscillator: weak-form starts, output error or multiple shooting, values with intervals."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.border.model_file import MechanismTable, ModelFile, ModelTable, Value
from rtctl.border.simulation import FreeParameter, Simulation
from rtctl.border.statistics import NORMAL_95
from rtctl.identification.fit import Fit, FitError
from rtctl.identification.fit_record import FitRecord, select_fit_records
from rtctl.identification.oscillator.start_values import generate_starts
from rtctl.identification.regression.weak_form import WeakFit
from rtctl.identification.simulation_error.multiple_shooting import ShootingOptions, fit_multiple_shooting
from rtctl.identification.simulation_error.output_error import (
    MultiStartOptions,
    ReportProgress,
    fit_output_error,
)
from rtctl.identification.simulation_error.trajectory_divergence import measure_divergence
from rtctl.measured.dataset import Dataset

KIND = "oscillator"
NOMINAL = ("damping", "stiffness", "stiffness_cubic", "drive_gain")
MAX_RESIDUAL_SHARE = 0.3
"""RMS residual relative to the motion above which a fit is not trusted.

A free run in the wrong well or out of step is off by more.
"""
CONSTANT_RESIDUAL_RATIO = 0.7
"""Mean over RMS of a residual above which it is called constant: half of its power."""
LEAST_SAMPLES_PER_UNKNOWN = 10
"""Scored samples for each unknown (parameters, and two numbers of each record's start) below which nothing is fitted.

Fewer leave no residual from which noise and standard errors could be estimated.
"""
NOT_TRUSTED = (
    "do not use this model, because {left}. Check that drive and displacement are not swapped and belong together, the "
    "sample rate, and the units; give a start model (--model) with better values or with what the equation lacks, and "
    "run rtctl diagnose, which names what is missing"
)
UNDRIVEN = (
    "the drive is constant in all fitted records, so nothing shows the gain from it to the motion: drive_gain is left "
    "out of the model; add a record with a drive that varies"
)
TRENDING_DRIVE = 0.5
"""Variation of a drive about a straight line over its whole variation, below which its record is a slow ramp."""
Build = Callable[[ModelFile, Mapping[str, str], str], Simulation]


@dataclass(frozen=True, slots=True, kw_only=True)
class OscillatorFitOptions(MultiStartOptions):
    """Options of the identification."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OscillatorFit:
    """A model file and the fit behind it."""

    model: ModelFile
    """Model file without provenance."""
    fit: Fit
    weak: WeakFit
    reason: str
    """Why the method was chosen."""
    warnings: tuple[str, ...]
    records: tuple[FitRecord, ...]
    """The fitted records."""
    trusted: bool = True
    """Whether the fit follows the data at all; if not, standard errors of its parameters mean nothing."""


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
        build: Binds a model to units (`rtctl.wiring.build_simulation`).
        options: Numbers of starts and iterations.
        source: Name of the start model in messages.
        report: Receives the progress.

    Raises:
        InputError: There is nothing to fit.
        FitError: No start leads to a bounded simulation.
    """
    options = options or OscillatorFitOptions()
    records = _select_usable_records(dataset)
    undriven = model is None and _is_undriven(records)
    start = model or _make_nominal_model(build, dataset.units, without=("drive_gain",) if undriven else ())
    simulation = build(start, dataset.units, source)
    if all(parameter.fixed for parameter in simulation.parameters):
        raise InputError(f"{source}: every parameter is fixed or missing: there is nothing to fit")
    _check_number_of_samples(dataset, records, simulation)
    report("start values", 0.0)
    starts = generate_starts(simulation, records, options.starts, options.seed, trust_own=model is not None)
    fit, reason, free_share = _fit_by_suitable_method(simulation, records, starts.values, options, report)
    doubt = _describe_doubt(_compute_residual_share(fit, records, without_mean=True), free_share)
    return OscillatorFit(
        model=_write_model(start, fit, with_errors=not doubt),
        trusted=not doubt,
        fit=fit,
        weak=starts.weak,
        reason=reason,
        warnings=(
            *((NOT_TRUSTED.format(left=doubt),) if doubt else ()),
            *((UNDRIVEN,) if undriven else ()),
            *_collect_warnings(fit),
        ),
        records=records,
    )


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
    starts: list[FloatArray],
    options: OscillatorFitOptions,
    report: ReportProgress,
) -> tuple[Fit, str, float]:
    """Fit by the method that the data allow.

    Returns:
        The fit, why its method was chosen, and, of a fit by segments, what free runs with its values leave of the
        motion (RMS share; NaN where the motion is not predictable, and of other fits).
    """
    shooting = ShootingOptions(fit=options.fit)
    parts = measure_divergence(simulation, records, starts[0])
    if parts.is_chaotic:
        fit = fit_multiple_shooting(simulation, records, shooting, starts=starts, report=report)
        reason = (
            f"two runs of record {parts.record} from nearly the same start part {parts.growth:.0e} times "
            f"(exponent {parts.rate:.2g} 1/s): a long free run says nothing"
        )
        return fit, reason, _compute_free_share(fit, records, options)
    free_run = fit_output_error(simulation, records, options.fit, starts=starts, report=report)
    left = _compute_residual_share(free_run, records)
    if left <= MAX_RESIDUAL_SHARE:
        return free_run, f"free runs follow the data to {100.0 * left:.2g} %", np.nan
    short = fit_multiple_shooting(simulation, records, shooting, starts=starts, report=report)
    follows = _compute_residual_share(short, records)
    if follows < 0.5 * left:
        reason = (
            f"free runs leave {100.0 * left:.2g} % of the motion unexplained (another well, or a start too far off), "
            f"segments of a period follow it to {100.0 * follows:.2g} %"
        )
        return short, reason, _compute_free_share(short, records, options)
    return (
        free_run,
        f"neither free runs nor segments follow the data ({100.0 * left:.2g} % unexplained)",
        np.nan,
    )


def _compute_free_share(fit: Fit, records: tuple[FitRecord, ...], options: OscillatorFitOptions) -> float:
    """Return what free runs with the values of a fit by segments leave of the motion, each start fitted.

    NaN where neighbouring trajectories diverge exponentially at these values: then a free run says nothing.
    """
    values = np.array([one.value for one in fit.simulation.parameters])
    if measure_divergence(fit.simulation, records, values).is_chaotic:
        return float("nan")
    try:
        free = fit_output_error(fit.simulation, records, options.fit, starts=[values], free=())
    except FitError:
        return float("inf")
    return _compute_residual_share(free, records, without_mean=True)


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


def _select_usable_records(dataset: Dataset) -> tuple[FitRecord, ...]:
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


def _make_nominal_model(build: Build, units: Mapping[str, str], without: Sequence[str] = ()) -> ModelFile:
    """Return the nominal model with all parameters free but those left out, in the data's units."""
    empty = build(ModelFile(model=ModelTable(kind=KIND)), units, "nominal model")
    return ModelFile(
        model=ModelTable(
            kind=KIND,
            parameters={
                one.name: Value(value=0.0, unit=_simplify_unit(one.unit))
                for one in empty.parameters
                if one.name in NOMINAL and one.name not in without
            },
        )
    )


def _simplify_unit(unit: str) -> str:
    """Remove brackets around single names: 1/((V)^2*s^2) becomes 1/(V^2*s^2)."""
    while (shorter := re.sub(r"\((\w+)\)|\((\([^()]*\))\)", r"\1\2", unit)) != unit:
        unit = shorter
    return unit


def _write_model(start: ModelFile, fit: Fit, *, with_errors: bool) -> ModelFile:
    """Return `start` with the fitted values, errors and 95 % intervals, in its own units."""
    numbers = dict(zip(fit.names, zip(fit.values, fit.standard_errors, strict=True), strict=True))
    parameters = {one.name: one for one in fit.simulation.parameters}

    def moved(name: str, old: Value) -> Value:
        if name not in numbers:
            return old
        value, error = numbers[name]
        return _write_value(old, parameters[name], float(value), float(error) if with_errors else np.inf)

    return ModelFile(
        model=ModelTable(
            kind=KIND,
            parameters={name: moved(name, old) for name, old in start.model.parameters.items()},
            mechanisms=tuple(
                MechanismTable(
                    id=table.id,
                    parameters={
                        name: moved(f"{table.id}.{name}", old) for name, old in table.parameters.items()
                    },
                )
                for table in start.model.mechanisms
            ),
        )
    )


def _write_value(old: Value, parameter: FreeParameter, value: float, error: float) -> Value:
    """Return a value in the unit of `old`; without errors where the data do not determine it."""
    unit = old.unit
    factor = Value(value=1.0, unit=parameter.unit).to(unit) if unit != parameter.unit else 1.0
    known: dict[str, Any] = {}
    if error < float("inf"):
        half = NORMAL_95 * error
        low, high = max(value - half, parameter.low), min(value + half, parameter.high)
        known = {"low": low * factor, "high": high * factor, "standard_error": error * factor}
    return Value(value=value * factor, unit=unit, **known)


def _collect_warnings(fit: Fit) -> tuple[str, ...]:
    said = list(fit.determinability.describe())
    if fit.status != "converged":
        said.append(f"the fit {fit.status}" if fit.status.startswith("stopped") else str(fit.status))
    for k, name in zip(fit.free, fit.names, strict=True):
        parameter = fit.simulation.parameters[k]
        if parameter.value in (parameter.low, parameter.high):
            said.append(
                f"{name} ended on its bound, {parameter.value:g} {parameter.unit}: the model is short of something"
            )
    if fit.method == "multiple_shooting" and fit.simulation.mechanisms:
        said.append("a mechanism with a memory or a clock of its own began anew with each segment")
    return (*said, *_describe_offsets(fit))


def _describe_offsets(fit: Fit) -> list[str]:
    """Describe residuals that are mostly a constant, which has a simple cause."""
    said = []
    for record, outputs in fit.residuals.items():
        for name, residual in outputs.items():
            mean, rms = float(np.mean(residual)), fit.record_rms[record][name]
            if abs(mean) > CONSTANT_RESIDUAL_RATIO * rms:
                said.append(
                    f"record {record}: {name} is simulated {abs(mean):.3g} too {'high' if mean > 0.0 else 'low'} on "
                    f"average, {100.0 * (mean / rms) ** 2:.0f} % of its residual's power: a start model (--model) with "
                    "sensor.offset or drive.offset would take that"
                )
    return said
