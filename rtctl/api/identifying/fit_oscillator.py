"""An oscillator's dataset to a `Fit`: parameters with standard errors, the picture of the worst record."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rtctl.api.identifying.fit import Fit
from rtctl.api.model import Model
from rtctl.border.model_file import ModelFile
from rtctl.identification.oscillator.identify import OscillatorFit, OscillatorFitOptions, identify_oscillator
from rtctl.measured.dataset import Dataset
from rtctl.output.progress import Reporter
from rtctl.version import __version__
from rtctl.wiring import build_simulation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHARES = 1000
"""Steps of the progress bar."""


def fit_oscillator(
    dataset: Dataset, start: Model | None, options: OscillatorFitOptions, report: Reporter
) -> Fit:
    """Fit the parameters of `start` that are not fixed; without one the nominal four.

    Raises:
        InputError: There is nothing to fit.
        FitError: No start leads anywhere.
    """
    source = "nominal model" if start is None else str(start.source or "start model")
    with report.bar(f"identify {dataset.name}", SHARES) as advance:
        result = identify_oscillator(
            dataset, None if start is None else start.content, build_simulation, options,
            source=source, report=lambda text, share: advance(round(SHARES * share)),
        )  # fmt: skip
    provenance = provenance_of(result, dataset, None if start is None else source, options)
    content = ModelFile(model=result.model.model, provenance=provenance)
    return Fit(
        model=Model(kind="oscillator", content=content),
        dataset=dataset.name,
        method=f"{result.fit.method.replace('_', ' ')}, {result.reason}",
        residual_rms=dict(result.fit.rms),
        units=dict(dataset.units),
        trusted=result.trusted,
        warnings=result.warnings,
        result=result,
        _summary=summary_of(result, dataset),
        _draw=lambda: worst_record_figure(result, dataset),
    )


def provenance_of(
    result: OscillatorFit, dataset: Dataset, start: str | None, options: OscillatorFitOptions
) -> dict[str, Any]:
    """Return what the model file says of where it comes from."""
    files = sorted({record.file for record in dataset.records if record.file})
    folder = dataset.path.parent
    command = f"rtctl identify {dataset.path} --kind oscillator" + (f" --model {start}" if start else "")
    return {
        "dataset": str(dataset.path),
        "dataset_name": dataset.name,
        "sha256": {name: _sha256(folder / name) for name in [dataset.path.name, *files]},
        "command": f"{command} --starts {options.starts} --seed {options.seed}",
        "version": __version__,
        "trusted": result.trusted,
        "method": result.fit.method,
        "reason": result.reason,
        "residual_rms": {
            name: {"value": rms, "unit": dataset.units[name]} for name, rms in result.fit.rms.items()
        },
        "fitted_records": [record.name for record in result.records],
        "undetermined": list(result.fit.determinability.undetermined),
        "warnings": list(result.warnings),
    }


def summary_of(result: OscillatorFit, dataset: Dataset) -> dict[str, Any]:
    """Return the figures of the fit for scripts."""
    fit = result.fit
    estimates = zip(fit.names, fit.values.tolist(), fit.standard_errors.tolist(), fit.free, strict=True)
    return {
        "trusted": result.trusted,
        "method": fit.method,
        "reason": result.reason,
        "status": str(fit.status),
        "iterations": fit.iterations,
        "parameters": {
            name: {"value": value, "standard_error": error, "unit": fit.simulation.parameters[k].unit}
            for name, value, error, k in estimates
        },
        "correlation": fit.correlation.tolist(),
        "condition": fit.determinability.condition,
        "undetermined": list(fit.determinability.undetermined),
        "warnings": list(result.warnings),
        "residual_rms": {name: {"value": rms, "unit": dataset.units[name]} for name, rms in fit.rms.items()},
        "records": {name: dict(rms) for name, rms in fit.record_rms.items()},
        "weak_form": {
            "half_width_s": result.weak.half_width_s,
            "coefficients": dict(result.weak.coefficients),
            "share_left": result.weak.residual_share,
        },
    }


def worst_record_figure(result: OscillatorFit, dataset: Dataset) -> Figure:
    """Return measured, simulated and error, in time and frequency, of the fitted record with the largest residual."""
    from rtctl.plots.comparison import Compared, comparison_figure

    fit = result.fit
    output = next(iter(fit.rms))
    k = int(np.argmax([fit.record_rms[record.name][output] for record in result.records]))
    record = result.records[k]
    residual = fit.residuals[record.name][output]
    scored = slice(record.first, record.first + len(residual))
    measured = record.measured[output][scored]
    segments = " in segments" if fit.method == "multiple_shooting" else ""
    return comparison_figure(
        Compared(
            title=f"{dataset.name}, {record.name}, fitted" + segments,
            output=output,
            unit=dataset.units[output],
            time_s=record.period_s * np.arange(scored.start, scored.stop, dtype=np.float64),
            measured=measured,
            simulated=measured + residual,
        )
    )


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
