"""A fit as a person reads it in a terminal: parameters or qualities, residuals, what the data do not determine."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rtctl.api.identifying.fit import Fit
from rtctl.identification.residual_words import judge_residual
from rtctl.measured.dataset import FREQUENCY
from rtctl.output.readable_units import readable
from rtctl.output.tables import print_table


def print_fit(fit: Fit, path: Path, picture: Path | None = None) -> None:
    """Print how well a model fits its data, and where it and its picture were written."""
    (_print_vo2 if fit.model.kind == "vo2" else _print_oscillator)(fit)
    for warning in fit.warnings:
        print(f"note: {warning}")
    print(f"wrote {path}" + (f" and its picture {picture}" if picture else ""))


def _print_oscillator(fit: Fit) -> None:
    found = fit.result.fit
    rows = []
    for k, name in enumerate(found.names):
        value = fit.parameters[name]
        error = f"{value.standard_error:.2g}" if value.standard_error is not None else "not determined"
        others = np.delete(np.abs(np.nan_to_num(found.correlation[k])), k)
        most = f"{others.max():.3f}" if len(others) else "–"
        rows.append([name, f"{value.value:.7g}", error, value.unit, most])
    headers = ["parameter", "value", "standard error", "unit", "largest correlation with another"]
    print_table(f"{fit.dataset}: {fit.method}", headers, rows)
    for name, rms in fit.residual_rms.items():
        measured = [record.measured[name][record.first :] for record in fit.result.records]
        every = np.concatenate(measured)
        is_sweep = any(FREQUENCY in record.stimulus.inputs for record in fit.result.records)
        size = float(np.sqrt(np.mean(every**2)) if is_sweep else np.std(every))
        share = "and nothing varies"
        if size > 0.0:
            left = (
                [] if is_sweep else [outputs[name] for outputs in found.residuals.values() if name in outputs]
            )
            share = f"{100.0 * rms / size:.3g} % of its variation, {judge_residual(rms / size, left)}"
        print(f"{name}: residual {readable(rms, fit.units[name])} RMS, {share}")
    for record, outputs in fit.to_dict().get("rms_error_test", {}).items():
        errors = ", ".join(f"{name} {readable(one['value'], one['unit'])}" for name, one in outputs.items())
        print(f"test record {record}: free run off by {errors} RMS")
    _print_derived(fit)


def _print_derived(fit: Fit) -> None:
    """Print what follows from the parameters in the terms of those who use the device."""
    for name, text in (one.in_words() for one in fit.derived):
        print(f"{name}: {text}")


def _print_vo2(fit: Fit) -> None:
    model = fit.result
    rows = [
        [name, f"{q.mean_abs:.4g} {q.unit}", f"{100 * q.mean_abs / q.range:.2f} %", f"{q.max_abs:.4g} {q.unit}",
         f"{100 * q.max_abs / q.range:.2f} %"]
        for name, q in model.quality.items()
    ]  # fmt: skip
    headers = ["fit on the identification data", "mean abs", "of range", "max abs", "of range"]
    print_table(f"model of {model.identity or 'the device'}", headers, rows)
    if not np.isfinite(model.time_constant_error_s):
        print(
            f"time constant of the heating: {readable(model.time_constant_s, 's')} (nominal: the data do not tell)"
        )
    _print_derived(fit)
    if model.deflection_error_elsewhere and model.reading_error_elsewhere:
        print(
            f"on swings of the staircases that took no part in a fit: {model.deflection_error_elsewhere:.3g} um of the "
            f"deflection, {model.reading_error_elsewhere:.3g} of ln R (RMS); expect as much on other records"
        )
