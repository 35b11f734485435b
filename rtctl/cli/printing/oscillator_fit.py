"""`rtctl identify --kind oscillator`: fits, says how well and what is not determined, writes model and picture."""

from __future__ import annotations

import argparse
import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from rtctl import __version__
from rtctl.border.model_file import ModelFile
from rtctl.evaluation.metrics import finite
from rtctl.extras import can_draw
from rtctl.identification.oscillator.identify import OscillatorFit, OscillatorFitOptions, identify_oscillator
from rtctl.measured.dataset import Dataset
from rtctl.measured.reading import read_dataset
from rtctl.models.oscillator import read_oscillator_model, write_oscillator_model
from rtctl.output.progress import print_table, progress_bar
from rtctl.wiring import build_simulation


def run_oscillator(args: argparse.Namespace) -> int:
    """The verb for this kind."""
    quiet = args.quiet or args.json
    start = read_oscillator_model(args.model) if args.model else None
    dataset = read_dataset(args.dataset)
    options = OscillatorFitOptions(starts=args.starts, seed=args.seed)
    with progress_bar(f"identify {dataset.name}", 1000, quiet=quiet) as advance:
        found = identify_oscillator(
            dataset, start, build_simulation, options,
            source=str(args.model or "nominal model"), report=lambda text, share: advance(round(1000 * share)),
        )  # fmt: skip
    provenance = provenance_of(found, dataset, args)
    write_oscillator_model(args.out, ModelFile(model=found.model.model, provenance=provenance))
    if not args.no_plot:
        draw_worst_record(args.out.with_suffix(".png"), found, dataset)
    if args.json:
        print(json.dumps(finite({"model": str(args.out), **summary_of(found, dataset)}), indent=2))
    elif not args.quiet:
        print_fit(found, dataset, args.out)
    return 0 if found.trusted else 1


def provenance_of(found: OscillatorFit, dataset: Dataset, args: argparse.Namespace) -> dict[str, Any]:
    """What the model file says of where it comes from."""
    files = sorted({record.file for record in dataset.records if record.file})
    folder = dataset.path.parent
    command = f"rtctl identify {args.dataset} --kind oscillator" + (
        f" --model {args.model}" if args.model else ""
    )
    return {
        "dataset": str(args.dataset),
        "dataset_name": dataset.name,
        "sha256": {name: _sha256(folder / name) for name in [dataset.path.name, *files]},
        "command": f"{command} --starts {args.starts} --seed {args.seed}",
        "version": __version__,
        "trusted": found.trusted,
        "method": found.fit.method,
        "reason": found.reason,
        "residual_rms": {
            name: {"value": rms, "unit": dataset.units[name]} for name, rms in found.fit.rms.items()
        },
        "fitted_records": [record.name for record in found.records],
        "undetermined": list(found.fit.determinability.undetermined),
        "warnings": list(found.warnings),
    }


def summary_of(found: OscillatorFit, dataset: Dataset) -> dict[str, Any]:
    """For scripts."""
    fit = found.fit
    return {
        "trusted": found.trusted,
        "method": fit.method,
        "reason": found.reason,
        "status": str(fit.status),
        "iterations": fit.iterations,
        "parameters": {
            name: {
                "value": value,
                "standard_error": error,
                "unit": fit.simulation.parameters[k].unit,
            }
            for name, value, error, k in zip(
                fit.names, fit.values.tolist(), fit.standard_errors.tolist(), fit.free, strict=True
            )
        },
        "correlation": fit.correlation.tolist(),
        "condition": fit.determinability.condition,
        "undetermined": list(fit.determinability.undetermined),
        "warnings": list(found.warnings),
        "residual_rms": {name: {"value": rms, "unit": dataset.units[name]} for name, rms in fit.rms.items()},
        "records": {name: dict(rms) for name, rms in fit.record_rms.items()},
        "weak_form": {
            "half_width_s": found.weak.half_width_s,
            "coefficients": dict(found.weak.coefficients),
            "share_left": found.weak.residual_share,
        },
    }


def print_fit(found: OscillatorFit, dataset: Dataset, path: Path) -> None:
    """Parameters with errors, what is left, and what the data do not determine."""
    fit = found.fit
    rows = []
    written = found.model.model
    values = dict(written.parameters)
    for table in written.mechanisms:
        values |= {f"{table.id}.{name}": value for name, value in table.parameters.items()}
    for k, name in enumerate(fit.names):
        value = values[name]
        error = f"{value.standard_error:.2g}" if value.standard_error is not None else "not determined"
        others = np.delete(np.abs(np.nan_to_num(fit.correlation[k])), k)
        most = f"{others.max():.3f}" if len(others) else "–"
        rows.append([name, f"{value.value:.7g}", error, value.unit, most])
    print_table(
        f"{dataset.name}: {fit.method.replace('_', ' ')}, {found.reason}",
        ["parameter", "value", "standard error", "unit", "largest correlation"],
        rows,
    )
    for name, rms in fit.rms.items():
        signal = np.sqrt(np.mean(np.concatenate([r.measured[name][r.first :] for r in found.records]) ** 2))
        unit = dataset.units[name]
        print(f"{name}: residual {rms:.4g} {unit} RMS, {100.0 * rms / signal:.3g} % of its signal")
    for warning in found.warnings:
        print(f"note: {warning}")
    print(f"wrote {path}")


def draw_worst_record(path: Path, found: OscillatorFit, dataset: Dataset) -> None:
    """Measured, simulated and error in time and frequency of the fitted record that is matched worst."""
    if not can_draw():
        return
    from rtctl.plots.comparison import Compared, plot_comparison

    fit = found.fit
    output = next(iter(fit.rms))
    k = int(np.argmax([fit.record_rms[record.name][output] for record in found.records]))
    record = found.records[k]
    residual = fit.residuals[record.name][output]
    scored = slice(record.first, record.first + len(residual))
    measured = record.measured[output][scored]
    segments = " in segments" if fit.method == "multiple_shooting" else ""
    plot_comparison(
        path,
        Compared(
            title=f"{dataset.name}, {record.name}, fitted" + segments,
            output=output,
            unit=dataset.units[output],
            time_s=record.period_s * np.arange(scored.start, scored.stop, dtype=np.float64),
            measured=measured,
            simulated=measured + residual,
        ),
    )


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
