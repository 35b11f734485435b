"""A dataset and a user's equations to a `Fit`: parameters with standard errors, starts, errors on test records."""

from __future__ import annotations

from rtctl.api.identifying.by_runs import provenance_of, summary_of, worst_record_figure
from rtctl.api.identifying.fit import Fit
from rtctl.api.model import Model
from rtctl.border.equations.file import EquationsFile
from rtctl.border.errors import InputError
from rtctl.identification.equations.identify import EquationsFit, EquationsFitOptions, identify_equations
from rtctl.measured.dataset import Dataset
from rtctl.models.temperatures import describe_celsius
from rtctl.output.progress import Reporter
from rtctl.wiring_models import build_simulation

SHARES = 1000
"""Steps of the progress bar."""
NO_MODEL = (
    "{}: equations and units (FMU) are identified from a start model, which says how they look: give its file by "
    "--model (model= in Python)"
)


def fit_equations(
    dataset: Dataset, start: Model | None, options: EquationsFitOptions, report: Reporter
) -> Fit:
    """Fit the parameters of `start` that are not fixed, and the starts of records that are not known.

    Raises:
        InputError: There is no start model, or nothing to fit.
        FitError: No start leads anywhere.
    """
    if start is None:
        raise InputError(NO_MODEL.format(dataset.path))
    source = str(start.source or "start model")
    with report.bar(f"identify {dataset.name}", SHARES) as advance:
        result = identify_equations(
            dataset, start.content, build_simulation, options,
            source=source, report=lambda text, share: advance(round(SHARES * share)),
        )  # fmt: skip
    celsius = describe_celsius(start.content, dataset) if isinstance(start.content, EquationsFile) else ()
    asked = {"starts": options.starts, "seed": options.seed}
    tested = _tested(result, dataset)
    provenance = {**provenance_of(result, dataset, source, asked), "rms_error_test": tested}
    return Fit(
        model=Model(kind=start.kind, content=result.model.model_copy(update={"provenance": provenance})),
        dataset=dataset.name,
        method=f"{result.fit.method.replace('_', ' ')}, {result.reason}",
        residual_rms=dict(result.fit.rms),
        units=dict(dataset.units),
        trusted=result.trusted,
        warnings=(*celsius, *result.warnings),
        result=result,
        correction=result.correction,
        _summary={**summary_of(result, dataset), "rms_error_test": tested},
        _draw=lambda: worst_record_figure(result, dataset),
    )


def _tested(result: EquationsFit, dataset: Dataset) -> dict[str, dict[str, dict[str, float | str]]]:
    """Return the RMS error of each output of each test record, with unit."""
    return {
        record: {name: {"value": rms, "unit": dataset.units[name]} for name, rms in outputs.items()}
        for record, outputs in result.tested.items()
    }
