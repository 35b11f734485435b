"""Identify a user's equations: least squares on free runs from the start model, more starts where that gets stuck."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.equations.fmu_file import UserModel
from rtctl.border.errors import InputError
from rtctl.border.simulation import Simulation
from rtctl.identification.equations.starts import make_starts, shoot, trajectory_scales
from rtctl.identification.equations.structure import structurally_undetermined
from rtctl.identification.equations.writing import write_fitted
from rtctl.identification.fit import Fit, FitError
from rtctl.identification.fit_record import FitRecord, make_fit_record, select_fit_records
from rtctl.identification.hold_comparison import HoldDoubt, compare_holds
from rtctl.identification.least_squares.levenberg_marquardt import Minimum, Unknowns, minimise
from rtctl.identification.residual_words import NO_INTERVALS, lacks_something
from rtctl.identification.simulation_error.inference import infer
from rtctl.identification.simulation_error.output_error import (
    FitOptions,
    MultiStartOptions,
    ReportProgress,
    compute_signal_sizes,
    polish,
)
from rtctl.identification.simulation_error.record_unknowns import LOST, fit_record_unknowns
from rtctl.identification.simulation_error.segments import Segment, SegmentCost
from rtctl.identification.simulation_error.sensitivity import Sensitivity
from rtctl.identification.threads import open_thread_pool
from rtctl.measured.dataset import Dataset

KIND = "equations"
MAX_RESIDUAL_SHARE = 0.3
"""RMS residual relative to an output's variation above which a fit is not trusted, and other starts are tried."""
LEAST_SAMPLES_PER_UNKNOWN = 5
"""Scored samples for each unknown below which nothing is fitted: none would be left to tell the noise."""
NOT_TRUSTED = (
    "do not use this model, because it leaves {:.3g} % of what {} does. A diagnosis (rtctl diagnose) names what the "
    "equations lack. If it names nothing, give better values to start from, or bounds (low, high); check the "
    "sample rate and the units, and that inputs and outputs are not swapped and belong together"
)
STARTS_ELSEWHERE = (
    "test record {}: from the model's start its free run loses it; its error is that of a run from a start that was "
    "fitted to the record itself (where you know it, say it: initial in its [[records]])"
)
ITERATIONS_OF_START, TOLERANCE_OF_START = 12, 1e-6
MOST_STARTS_SOUGHT, LEAST_GAIN = 3, 0.99
"""How often the starts of records that are lost are looked for, and the cost, over that before, to look again."""
HELD = (
    "these data cannot tell {} apart, and no other input would: only combinations of them act on what is measured. {}, "
    "as in the model file, and the others are right for that; fix the one that you know best (fixed = true), or "
    "measure a further output"
)
Build = Callable[[Any, Mapping[str, str], str], Simulation]


@dataclass(frozen=True, slots=True, kw_only=True)
class EquationsFitOptions(MultiStartOptions):
    """Options of the identification; other starts are tried where the fit from the start model does not follow."""

    fit: FitOptions = field(default_factory=lambda: FitOptions(screening_iterations=30, final_iterations=40))


@dataclass(frozen=True, slots=True, kw_only=True)
class EquationsFit:
    """A model file and the fit behind it."""

    model: UserModel
    """Model file without provenance."""
    fit: Fit
    reason: str
    """How the fit was reached."""
    warnings: tuple[str, ...]
    records: tuple[FitRecord, ...]
    """The fitted records."""
    tested: Mapping[str, Mapping[str, float]]
    """RMS error of the free run of each test record by output, from the start in the model's file or the record's."""
    trusted: bool = True
    """Whether the fit follows the data at all; if not, standard errors of its parameters mean nothing."""
    correction: str = ""
    """What to write in the manifest before anything else; "": nothing."""


def identify_equations(
    dataset: Dataset,
    model: UserModel,
    build: Build,
    options: EquationsFitOptions | None = None,
    *,
    source: str = "model",
    report: ReportProgress = lambda text, share: None,
) -> EquationsFit:
    """Fit the parameters of `model` that are not fixed, and the starts of records that are not known.

    Args:
        dataset: Records whose signals the model names.
        model: Structure, start values and bounds.
        build: Binds a model to units (`rtctl.wiring_models.build_simulation`).
        options: Numbers of starts and iterations.
        source: Name of the start model in messages.
        report: Receives the progress.

    Raises:
        InputError: There is nothing to fit.
        FitError: No start leads to a bounded simulation.
    """
    options = options or EquationsFitOptions()
    records = select_fit_records(dataset)
    simulation = build(model, dataset.units, source)
    _check_records(dataset, records, simulation, source)
    fit, reason = _fit(simulation, records, options, report)
    fit, held = _with_known_scale(simulation, fit, records, options, report)
    output, left = _residual_share(fit, records)
    trusted = left <= MAX_RESIDUAL_SHARE
    lacking = trusted and lacks_something(left, [outputs[output] for outputs in fit.residuals.values()])
    fitted = write_fitted(model, fit, with_errors=trusted and not lacking)
    doubt = HoldDoubt()
    if trusted:
        report("comparing holds of the inputs", 1.0)
        doubt = compare_holds(fit, records, partial(_fit_again, options=options), dataset.path)
    tested, starts = _test(build(fitted, dataset.units, source), dataset)
    return EquationsFit(
        model=fitted,
        fit=fit,
        reason=f"{reason}, free runs leave {100.0 * left:.2g} % of the variation of {output}",
        warnings=(
            *(() if trusted else (NOT_TRUSTED.format(100.0 * left, output),)),
            *((NO_INTERVALS.format(left=100.0 * left),) if lacking else ()),
            *held,
            *((doubt.text,) if doubt.text else ()),
            *fit.describe_doubts(with_errors=trusted and not lacking),
            *starts,
        ),
        records=records,
        tested=tested,
        trusted=trusted,
        correction=doubt.correction,
    )


def _fit_again(
    simulation: Simulation, records: Sequence[FitRecord], options: EquationsFitOptions
) -> Fit | None:
    """Return the fit from the simulation's own values; None where it diverges from there."""
    try:
        return _fit(simulation, records, replace(options, starts=1), lambda text, share: None)[0]
    except FitError:
        return None


def _with_known_scale(
    simulation: Simulation,
    fit: Fit,
    records: Sequence[FitRecord],
    options: EquationsFitOptions,
    report: ReportProgress,
) -> tuple[Fit, tuple[str, ...]]:
    """Return the fit in which parameters that no data tell stay at the file's values, and a note on them.

    Unchanged where there are none, or where the model does not follow the data with these values.
    """
    names = structurally_undetermined(fit.simulation, records) if fit.determinability.confounded else ()
    if not names:
        return fit, ()
    held, _ = _fit(simulation.holding(names), records, options, report)  # type: ignore[attr-defined]
    if _residual_share(held, records)[1] > 1.01 * _residual_share(fit, records)[1]:
        return fit, ()
    traded = dict.fromkeys(name for one in fit.determinability.confounded for name in one.names)
    values = {one.name: f"{one.name} stays at {one.value:.6g} {one.unit}" for one in simulation.parameters}
    held = replace(held, determinability=replace(held.determinability, held=names))
    return held, (HELD.format(", ".join(traded), " and ".join(values[name] for name in names)),)


def _fit(
    simulation: Simulation,
    records: Sequence[FitRecord],
    options: EquationsFitOptions,
    report: ReportProgress,
) -> tuple[Fit, str]:
    """Fit from the model's own values; where that does not follow the data, from other ones too."""
    scales, states = trajectory_scales(simulation, records)
    plain = Sensitivity.of(simulation, records, scales=scales)
    sensitivity = Sensitivity(
        simulation=simulation, free=plain.free, scale=plain.scale, state_scale=states, outputs=plain.outputs
    )
    with open_thread_pool(options.fit.threads) as executor:
        values = plain.current_values
        segments = [Segment(one, simulation.starting(one.stimulus, values), False) for one in records]
        cost = SegmentCost(
            sensitivity=sensitivity, segments=segments, sigma=compute_signal_sizes(sensitivity, records),
            executor=executor, steps_per_period=options.fit.coarse_steps_per_period,
        )  # fmt: skip
        report("fitting from the start model", 0.1)
        best, reason = _minimised(cost, values, options.fit), "from the start model"
        if options.starts > 1 and (best is None or _share_left(cost, best) > MAX_RESIDUAL_SHARE):
            tried = [*shoot(cost, values), *make_starts(simulation, options.starts - 1, options.seed)]
            for number, start in enumerate(tried):
                report("fitting from other starts", 0.2 + 0.4 * number / len(tried))
                found = _minimised(cost, start, options.fit)
                if found is not None and (best is None or found.equations.cost < best.equations.cost):
                    best, reason = found, "from another start"
        if best is None:
            raise FitError(
                "the model diverges from every start: it is unbounded there or far from the data; correct the start "
                "values or give bounds (low, high)"
            )
        cost, best = polish(cost, best, options.fit, report)
        return infer("output_error", cost, best), reason


def _minimised(cost: SegmentCost, start: FloatArray, options: FitOptions) -> Minimum | None:
    """Return the minimum that some iterations reach from full parameters `start`; None where the model diverges.

    Where a record is lost, its start is looked for at the values that were reached, and the fit goes on from there.
    """
    low, high = cost.sensitivity.bounds
    best: Minimum | None = None
    begin = cost.start(np.clip(start[cost.sensitivity.free] / cost.sensitivity.scale, low, high))
    for _ in range(1 + MOST_STARTS_SOUGHT):
        found = minimise(
            cost.equations, begin, low, high,
            iterations=options.screening_iterations, second_derivative=cost.compute_second_derivative,
        )  # fmt: skip
        if found is None or (best is not None and found.equations.cost > LEAST_GAIN * best.equations.cost):
            break
        best = found
        if not cost.sensitivity.simulation.state or _share_left(cost, found) <= MAX_RESIDUAL_SHARE:
            break
        begin = _with_sought_starts(cost, found)
    return best


def _with_sought_starts(cost: SegmentCost, found: Minimum) -> Unknowns:
    """Return the unknowns of a minimum, with starts of the records that are sought at its parameters."""
    simulation = cost.sensitivity.simulation.with_values(cost.sensitivity.values(found.unknowns.shared))
    starts = [
        fit_record_unknowns(
            simulation, one.record, one.record, iterations=ITERATIONS_OF_START, tolerance=TOLERANCE_OF_START,
        ).start
        for one in cost.segments
    ]  # fmt: skip
    return found.unknowns._replace(local=np.array(starts) / cost.sensitivity.state_scale)


def _share_left(cost: SegmentCost, found: Minimum) -> float:
    """Return the largest RMS residual of an output over its variation."""
    pieces = cost.compute_terms(found.unknowns) or []
    shares = []
    for row, name in enumerate(cost.sensitivity.outputs):
        measured = [one.record.measured[name][one.record.first :] for one in cost.segments]
        whole = np.concatenate(measured)
        rms = np.sqrt(sum(float(piece.square[row]) for piece in pieces) / len(whole))
        shares.append(float(rms / max(np.std(whole), 1e-300)))
    return max(shares, default=np.inf)


def _residual_share(fit: Fit, records: Sequence[FitRecord]) -> tuple[str, float]:
    """Return the output of which the most is left, and its RMS residual relative to its variation."""
    shares = {
        name: rms
        / max(float(np.std(np.concatenate([one.measured[name][one.first :] for one in records]))), 1e-300)
        for name, rms in fit.rms.items()
    }
    worst = max(shares, key=lambda name: shares[name])
    return worst, shares[worst]


def _check_records(
    dataset: Dataset, records: Sequence[FitRecord], simulation: Simulation, source: str
) -> None:
    """Raise InputError where there is nothing to fit, or too little to fit it to."""
    if not records:
        raise InputError(f'{dataset.path}: no record has use = "fit"; test records are never fitted')
    free = sum(not one.fixed for one in simulation.parameters)
    if free == 0 and not simulation.state:
        raise InputError(f"{source}: every parameter and every start is fixed: there is nothing to fit")
    outputs = [name for name in simulation.outputs if all(name in one.measured for one in records)]
    if not any(np.ptp(one.measured[name][one.first :]) for one in records for name in outputs):
        raise InputError(f"{dataset.path}: nothing moves, all outputs are constant in the records to fit")
    unknowns = free + len(simulation.state) * len(records)
    samples = len(outputs) * sum(one.samples - one.first for one in records)
    if samples < LEAST_SAMPLES_PER_UNKNOWN * unknowns:
        raise InputError(
            f"{dataset.path}: the records to fit have {samples} scored samples for {unknowns} unknowns ({free} "
            f"parameters, and the start of each record); at least {LEAST_SAMPLES_PER_UNKNOWN * unknowns} are needed"
        )
    for one in records:
        values = np.array([parameter.value for parameter in simulation.parameters])
        try:
            simulation.predict(one.truncate(2).stimulus, values)
        except ValueError as error:
            raise InputError(f"{source}: on record {one.name}: {error}") from None


def _test(simulation: Simulation, dataset: Dataset) -> tuple[dict[str, dict[str, float]], tuple[str, ...]]:
    """Return the RMS error of each test record's free run by output, infinite where it diverges, and notes on starts.

    A run that loses the record from the model's start is done again from one that is fitted to the record.
    """
    found: dict[str, dict[str, float]] = {}
    elsewhere = []
    for record in dataset.used_for("test"):
        one = make_fit_record(record, dataset.holds)
        read = {name: values for name, values in one.measured.items() if name in simulation.outputs}
        one = replace(one, measured=read)
        errors, lost = _free_run_errors(simulation, one)
        if lost and simulation.state:
            from_fitted = _free_run_errors(simulation, one, fitted=True)
            if sum(from_fitted[0].values()) < sum(errors.values()):
                errors = from_fitted[0]
                elsewhere.append(record.name)
        found[one.name] = errors
    return found, tuple(STARTS_ELSEWHERE.format(name) for name in elsewhere)


def _free_run_errors(
    simulation: Simulation, record: FitRecord, *, fitted: bool = False
) -> tuple[dict[str, float], bool]:
    """Return the RMS error of a free run by output, and whether it lost the record; `fitted`: from a fitted start."""
    values = np.array([one.value for one in simulation.parameters])
    try:
        start = None
        if fitted:
            start = fit_record_unknowns(
                simulation, record, record, iterations=ITERATIONS_OF_START, tolerance=TOLERANCE_OF_START
            ).start
        run = simulation.predict(record.stimulus, values, start)
    except ValueError:
        return dict.fromkeys(record.measured, np.inf), True
    if run.diverged_at[0] >= 0:
        return dict.fromkeys(record.measured, np.inf), True
    errors = {
        name: float(np.sqrt(np.mean((run.outputs[name][0] - measured)[record.first :] ** 2)))
        for name, measured in record.measured.items()
    }
    lost = any(rms > LOST * record.measured[name][record.first :].std() for name, rms in errors.items())
    return errors, lost
