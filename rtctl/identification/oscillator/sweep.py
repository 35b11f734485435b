"""Identify an oscillator from sweeps of frequencies: start values by harmonic balance, then its steady state.

With Z the complex amplitude of the displacement, A the drive's amplitude and w the angular frequency, the balance of
the fundamental is linear in the parameters,

    (stiffness - w^2 + i w damping + 3/4 stiffness_cubic |Z|^2) Z = drive_gain A

and each row is divided by the modulus of the bracket of the step before, so that it counts by the error of Z (C.
Sanathanan, J. Koerner, IEEE Trans. Automatic Control 8 (1963) 56). Its values start the fit of the simulated steady
state, whose residuals are those of the readings.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import ComplexArray, FloatArray
from rtctl.border.errors import InputError
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Simulation
from rtctl.identification.fit import Fit, FitError
from rtctl.identification.fit_record import FitRecord, derivative_order, response_of
from rtctl.identification.least_squares.levenberg_marquardt import minimise
from rtctl.identification.oscillator.identify import (
    MAX_RESIDUAL_SHARE,
    NOT_TRUSTED,
    OscillatorFit,
    OscillatorFitOptions,
    select_usable_records,
)
from rtctl.identification.oscillator.writing import Build, collect_warnings, make_nominal_model, write_model
from rtctl.identification.scales import estimate_scales
from rtctl.identification.simulation_error.inference import infer
from rtctl.identification.simulation_error.output_error import (
    FitOptions,
    ReportProgress,
    compute_signal_sizes,
    polish,
)
from rtctl.identification.simulation_error.segments import Segment, SegmentCost
from rtctl.identification.simulation_error.sensitivity import Sensitivity
from rtctl.identification.sweep_record import prepare_sweep
from rtctl.identification.threads import open_thread_pool
from rtctl.measured.dataset import FREQUENCY, Dataset, paired

BALANCES = 8
"""Steps of the balance's weights; they are settled after three or four."""
LEAST_READINGS_PER_PARAMETER = 3
"""Readings, two a row, for each parameter below which nothing is left from which a noise could be estimated."""


def identify_sweeps(
    dataset: Dataset,
    model: ModelFile | None,
    build: Build,
    options: OscillatorFitOptions | None = None,
    *,
    source: str = "model",
    report: ReportProgress = lambda text, share: None,
) -> OscillatorFit:
    """Fit the parameters of `model` that are not fixed, or the nominal four without a model; see `identify_oscillator`.

    Raises:
        InputError: There is nothing to fit, or the sweeps have fewer readings than the parameters need.
        FitError: No start leads to a bounded simulation.
    """
    options = options or OscillatorFitOptions()
    records = tuple(prepare_sweep(one) for one in select_usable_records(dataset))
    start = model or make_nominal_model(build, dataset.units)
    simulation = build(start, dataset.units, source)
    free = sum(not one.fixed for one in simulation.parameters)
    if not free:
        raise InputError(f"{source}: every parameter is fixed or missing: there is nothing to fit")
    readings = sum(record.samples for record in records)
    if readings < LEAST_READINGS_PER_PARAMETER * free:
        raise InputError(
            f"{dataset.path}: the sweeps to fit have {readings // 2} rows for {free} parameters; at least "
            f"{-(-LEAST_READINGS_PER_PARAMETER * free // 2)} are needed: measure more frequencies about the resonance"
        )
    report("start values", 0.0)
    starts = [_as_values(simulation, balance(records))]
    if model is not None:
        starts.insert(0, np.array([one.value for one in simulation.parameters]))
    fit = _fit(simulation, records, starts, options.fit, report)
    output = response_of(records)
    left = fit.rms[output] / float(compute_signal_sizes_of(records, output))
    doubt = f"it leaves {100.0 * left:.3g} % of the response" if left > MAX_RESIDUAL_SHARE else ""
    return OscillatorFit(
        model=write_model(start, fit, with_errors=not doubt),
        fit=fit,
        weak=None,
        reason=f"the simulated steady state follows the sweeps to {100.0 * left:.2g} %",
        warnings=(
            *((NOT_TRUSTED.format(left=doubt),) if doubt else ()),
            *collect_warnings(fit, dataset.units, with_errors=not doubt),
        ),
        records=records,
        trusted=not doubt,
    )


def compute_signal_sizes_of(records: Sequence[FitRecord], output: str) -> float:
    """Return the RMS of an output over all records."""
    return float(np.sqrt(np.mean(np.concatenate([one.measured[output] for one in records]) ** 2)))


def balance(records: Sequence[FitRecord]) -> dict[str, float]:
    """Return damping, stiffness, stiffness_cubic and drive_gain by the balance of the fundamental."""
    rate, drive, z = _phasors(records)
    size = float(np.abs(z).max())
    columns = np.column_stack([1j * rate * z, z, 0.75 * np.abs(z / size) ** 2 * z, -drive, -1j * drive])
    target = rate**2 * z
    weights = 1.0 / np.maximum(rate**2, 1e-300)
    found = np.zeros(5)
    for _ in range(BALANCES):
        rows = columns * weights[:, None]
        scale = np.maximum(np.sqrt(np.sum(np.abs(rows) ** 2, axis=0)), 1e-300)
        stacked = np.vstack([rows.real, rows.imag]) / scale
        wanted = np.concatenate([(target * weights).real, (target * weights).imag])
        found = np.linalg.lstsq(stacked, wanted, rcond=None)[0] / scale
        bracket = found[1] - rate**2 + 1j * rate * found[0] + 0.75 * found[2] * np.abs(z / size) ** 2
        weights = 1.0 / np.maximum(np.abs(bracket), 1e-3 * np.abs(bracket).max())
    damping, stiffness, cubic, gain, turned = found.tolist()
    return {
        "damping": abs(damping),
        "stiffness": stiffness,
        "stiffness_cubic": cubic / size**2,
        "drive_gain": float(np.copysign(np.hypot(gain, turned), gain)),
    }


def _phasors(records: Sequence[FitRecord]) -> tuple[FloatArray, FloatArray, ComplexArray]:
    """Return angular frequencies [1/s], drive amplitudes and complex displacements (rows,) of all records."""
    output = response_of(records)
    rate = 2.0 * np.pi * np.concatenate([one.stimulus.inputs[FREQUENCY][::2] for one in records])
    drive = np.concatenate([one.stimulus.inputs["drive"][::2] for one in records])
    z = np.concatenate([paired(one.measured[output]) for one in records])
    return rate, drive, z / (1j * rate) ** derivative_order(output)


def _as_values(simulation: Simulation, found: dict[str, float]) -> FloatArray:
    """Return all parameters (parameters,), the free ones of the nominal model at what was found, within bounds."""
    return np.array(
        [
            one.value
            if one.fixed or one.name not in found
            else float(np.clip(found[one.name], one.low, one.high))
            for one in simulation.parameters
        ]
    )


def _fit(
    simulation: Simulation,
    records: Sequence[FitRecord],
    starts: Sequence[FloatArray],
    options: FitOptions,
    report: ReportProgress,
) -> Fit:
    """Fit the steady state from each start, and iterate the best to convergence. Raises FitError."""
    sensitivity = Sensitivity.of(simulation, records, free_start=False, scales=estimate_scales(records))
    with open_thread_pool(options.threads) as executor:
        cost = SegmentCost(
            sensitivity=sensitivity, segments=[Segment(one, np.zeros(0), False) for one in records],
            sigma=compute_signal_sizes(sensitivity, records), executor=executor,
            steps_per_period=options.coarse_steps_per_period,
        )  # fmt: skip
        low, high = sensitivity.bounds
        reached = []
        for number, start in enumerate(starts):
            report("fitting the steady state", 0.1 + 0.4 * number / len(starts))
            shared = np.clip(start[sensitivity.free] / sensitivity.scale, low, high)
            found = minimise(
                cost.equations, cost.start(shared), low, high, iterations=options.screening_iterations
            )
            if found is not None:
                reached.append(found)
        if not reached:
            raise FitError("the model diverges from every start; give a start model by --model")
        cost, best = polish(cost, min(reached, key=lambda one: one.equations.cost), options, report)
        return infer("output_error", cost, best)
