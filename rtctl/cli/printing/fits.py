"""A fit as a person reads it in a terminal: parameters or qualities, residuals, what the data do not determine."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rtctl.api.identifying.fit import Fit
from rtctl.output.progress import print_table


def print_fit(fit: Fit, path: Path) -> None:
    """Print how well a model fits its data, and where it was written."""
    if fit.model.kind == "vo2":
        _print_vo2(fit, path)
    else:
        _print_oscillator(fit, path)


def _print_oscillator(fit: Fit, path: Path) -> None:
    found = fit.result.fit
    rows = []
    for k, name in enumerate(found.names):
        value = fit.parameters[name]
        error = f"{value.standard_error:.2g}" if value.standard_error is not None else "not determined"
        others = np.delete(np.abs(np.nan_to_num(found.correlation[k])), k)
        most = f"{others.max():.3f}" if len(others) else "–"
        rows.append([name, f"{value.value:.7g}", error, value.unit, most])
    headers = ["parameter", "value", "standard error", "unit", "largest correlation"]
    print_table(f"{fit.dataset}: {fit.method}", headers, rows)
    for name, rms in fit.residual_rms.items():
        measured = [record.measured[name][record.first :] for record in fit.result.records]
        signal = np.sqrt(np.mean(np.concatenate(measured) ** 2))
        print(f"{name}: residual {rms:.4g} {fit.units[name]} RMS, {100.0 * rms / signal:.3g} % of its signal")
    for record, outputs in fit.to_dict().get("rms_error_test", {}).items():
        errors = ", ".join(f"{name} {one['value']:.4g} {one['unit']}" for name, one in outputs.items())
        print(f"test record {record}: free run off by {errors} RMS")
    for warning in fit.warnings:
        print(f"note: {warning}")
    print(f"wrote {path}")


def _print_vo2(fit: Fit, path: Path) -> None:
    model = fit.result
    rows = [
        [name, f"{q.mean_abs:.4g} {q.unit}", f"{100 * q.mean_abs / q.range:.2f} %", f"{q.max_abs:.4g} {q.unit}",
         f"{100 * q.max_abs / q.range:.2f} %", f"{q.rms:.4g} {q.unit}"]
        for name, q in model.quality.items()
    ]  # fmt: skip
    headers = ["fit on the identification data", "mean abs", "of range", "max abs", "of range", "rms"]
    print_table(f"model of {model.identity or 'the device'}", headers, rows)
    known = np.isfinite(model.time_constant_error_s)
    error = f"+- {1e3 * model.time_constant_error_s:.2g} ms" if known else "(nominal: the data do not tell)"
    print(
        f"heating time constant {1e3 * model.time_constant_s:.4g} ms {error}; "
        f"deflection {model.deflection.low:.2f} to {model.deflection.high:.2f} um, resistance "
        f"{model.resistance.low / 1e3:.2f} to {model.resistance.high / 1e3:.2f} kohm"
    )
    if model.deflection_error_elsewhere and model.reading_error_elsewhere:
        print(
            f"on swings of the staircases that took no part in a fit: {model.deflection_error_elsewhere:.3g} um of the "
            f"deflection, {model.reading_error_elsewhere:.3g} of ln R (RMS); expect as much on other records"
        )
    print(f"wrote {path}")
    for warning in fit.warnings:
        print(f"note: {warning}")
