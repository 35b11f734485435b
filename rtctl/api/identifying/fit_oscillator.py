"""An oscillator's dataset to a `Fit`: parameters with standard errors, the picture of the worst record."""

from __future__ import annotations

from typing import Any

from rtctl.api.identifying.by_runs import provenance_of, summary_of, worst_record_figure
from rtctl.api.identifying.fit import Fit
from rtctl.api.model import Model
from rtctl.border.model_file import ModelFile
from rtctl.border.motion import with_displacement
from rtctl.identification.oscillator.identify import OscillatorFit, OscillatorFitOptions, identify_oscillator
from rtctl.identification.oscillator.standing_reading import SENSOR_ZERO
from rtctl.identification.oscillator.sweep import identify_sweeps
from rtctl.identification.scales import find_largest_displacement, find_longest_time
from rtctl.measured.dataset import Dataset
from rtctl.models.derived.oscillator import derive_from_file
from rtctl.output.progress import Reporter
from rtctl.wiring_models import build_simulation

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
        identify = identify_sweeps if dataset.has_sweeps else identify_oscillator
        result = identify(
            dataset, None if start is None else start.content, build_simulation, options,
            source=source, report=lambda text, share: advance(round(SHARES * share)),
        )  # fmt: skip
    provenance = provenance_of(
        result, dataset, None if start is None else source, {"starts": options.starts, "seed": options.seed}
    )
    content = ModelFile(model=result.model.model, provenance=provenance)
    zero = next((one.value for one in result.fit.simulation.parameters if one.name == SENSOR_ZERO), 0.0)
    largest = find_largest_displacement(result.records, zero=zero) if result.trusted else 0.0
    return Fit(
        model=Model(kind="oscillator", content=content),
        dataset=dataset.name,
        method=f"{result.fit.method.replace('_', ' ')}, {result.reason}",
        residual_rms=dict(result.fit.rms),
        units=dict(dataset.units),
        trusted=result.trusted,
        warnings=result.warnings,
        result=result,
        derived=derive_from_file(
            content, with_displacement(dataset.units), largest, find_longest_time(result.records)
        ),
        correction=result.correction,
        _summary={**summary_of(result, dataset), **_weak_form(result)},
        _draw=lambda: worst_record_figure(result, dataset),
    )


def _weak_form(result: OscillatorFit) -> dict[str, Any]:
    """Return the figures of the start values of records in time."""
    weak = result.weak
    if weak is None:
        return {}
    figures = {
        "half_width_s": weak.half_width_s,
        "coefficients": dict(weak.coefficients),
        "share_left": weak.residual_share,
    }
    return {"weak_form": figures}
