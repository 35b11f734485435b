"""What an identification by free runs tells: origin of the model, figures for scripts, a picture."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from rtctl.identification.fit import Fit
from rtctl.identification.fit_record import FitRecord
from rtctl.measured.dataset import FREQUENCY, Dataset
from rtctl.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class FittedByRuns(Protocol):
    """A fit of any kind of plant by free runs."""

    @property
    def fit(self) -> Fit:
        """Values, errors, residuals."""
        ...

    @property
    def reason(self) -> str:
        """Why the method was chosen."""
        ...

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the data do not determine."""
        ...

    @property
    def records(self) -> Sequence[FitRecord]:
        """The fitted records."""
        ...

    @property
    def trusted(self) -> bool:
        """Whether the fit follows the data at all."""
        ...


def provenance_of(
    result: FittedByRuns, dataset: Dataset, start: str | None, options: Mapping[str, int]
) -> dict[str, Any]:
    """Return what the model file says of where it comes from."""
    files = sorted({record.file for record in dataset.records if record.file})
    folder = dataset.path.parent
    command = f"rtctl identify {dataset.path} --kind {dataset.plant}" + (f" --model {start}" if start else "")
    return {
        "dataset": str(dataset.path),
        "dataset_name": dataset.name,
        "sha256": {name: _sha256(folder / name) for name in [dataset.path.name, *files]},
        "command": " ".join([command, *(f"--{name} {value}" for name, value in options.items())]),
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


def summary_of(result: FittedByRuns, dataset: Dataset) -> dict[str, Any]:
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
    }


def worst_record_figure(result: FittedByRuns, dataset: Dataset) -> Figure:
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
            frequency_hz=record.stimulus.inputs[FREQUENCY][::2] if dataset.has_sweeps else None,
        )
    )


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
