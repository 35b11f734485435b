"""A VO2 actuator's dataset to a `Fit`: hysteresis read-outs and heating, and what the staircases lack."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rtctl.api.identifying.fit import Fit
from rtctl.api.model import Model
from rtctl.border.statistics import NORMAL_95
from rtctl.identification.vo2.coarse_loops import describe_improvement, find_coarse_loops
from rtctl.identification.vo2.identify import Vo2FitOptions, identify_vo2
from rtctl.identification.vo2.lateness import LATE, find_late_rows
from rtctl.identification.vo2.settling import assess_staircases, describe_holds
from rtctl.identification.vo2.staircase import extract_steady_states
from rtctl.measured.dataset import Dataset
from rtctl.models.derived.quantity import Derived
from rtctl.models.derived.vo2 import derive_vo2
from rtctl.models.vo2 import Vo2Model
from rtctl.output.progress import Reporter
from rtctl.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TOO_COARSE = (
    "the static loops are too coarse, because domains of the film switch together: with the model's cells placed where "
    "they do, its error on the staircases would be {}; rtctl diagnose learns the loops anew where records to fit show "
    "where domains switch"
)
NOT_TRUSTED = (
    "do not use this model: its static loops are those of a device on the way, not at rest; measure again with holds "
    "as long as the next notes say"
)
READS_AFTER = (
    "the readings of a row answer the current of that row: they are taken at the end of its sample period, or the "
    "columns of the file are shifted by one row (timing_skew_rows = 1 in the model)"
)
SHOWN = {"resistance_preisach": "resistance", "deflection_preisach": "deflection"}
"""Fine read-outs whose residuals stand for the fit."""


def fit_vo2(dataset: Dataset, start: Model | None, options: Vo2FitOptions, report: Reporter) -> Fit:
    """Identify a VO2 actuator; `start` is None. Raises InputError where the data cannot do it."""
    model = identify_vo2(dataset, options, report.say)
    model = model.with_provenance(
        dataset=dataset.name, version=__version__, command="rtctl identify --kind vo2"
    )
    report.say("whether the static loops are too coarse")
    warnings, trusted = check_vo2(model, dataset)
    model = model.with_provenance(trusted=str(trusted).lower())
    quality = {name: one._asdict() for name, one in model.quality.items()}
    shown = {output: model.quality[name] for name, output in SHOWN.items() if name in model.quality}
    return Fit(
        model=Model(kind="vo2", content=model),
        dataset=dataset.name,
        method=f"hysteresis read-outs and heating of {model.identity or 'the device'}",
        residual_rms={output: one.rms for output, one in shown.items()},
        units={output: one.unit for output, one in shown.items()},
        trusted=trusted,
        warnings=warnings,
        result=model,
        derived=derive_vo2(model, {"": _estimates(model)}, dataset.units),
        _summary={"quality": quality, "trusted": trusted, "warnings": list(warnings)},
        _draw=lambda: staircase_figure(dataset, model),
    )


def _estimates(model: Vo2Model) -> dict[str, Derived]:
    """Return the time constant with its 95 % interval; none where the data do not tell it."""
    half = NORMAL_95 * model.time_constant_error_s
    if not np.isfinite(half):
        return {}
    value = model.time_constant_s
    return {"time_constant": Derived("time_constant", value, value - half, value + half, "s")}


def check_vo2(model: Vo2Model, dataset: Dataset) -> tuple[tuple[str, ...], bool]:
    """Return warnings of loops that are too coarse and of holds that were too short, and whether to trust the model."""
    coarse = find_coarse_loops(model, dataset)
    notes = [TOO_COARSE.format(describe_improvement(coarse))] if coarse else []
    settled = assess_staircases(model, dataset)
    notes += describe_holds(settled)
    notes += [READS_AFTER] if model.reads_after else []
    notes += _describe_lateness(model, dataset)
    trusted = not any(one.is_useless for _, one in settled)
    return (*(() if trusted else (NOT_TRUSTED,)), *notes), trusted


def _describe_lateness(model: Vo2Model, dataset: Dataset) -> list[str]:
    """Return the note on readings that come late, where the time constant was identified and they do."""
    records = [record for record in dataset.records if record.use != "test"]
    if model.reads_after or not math.isfinite(model.time_constant_error_s):
        return []
    read_outs = model.resistance_preisach, model.deflection_preisach
    late = find_late_rows(records, *read_outs, model.time_constant_s)
    return [LATE.format(late_ms=1e3 * late * records[0].period_s)] if late else []


def staircase_figure(dataset: Dataset, model: Vo2Model) -> Figure:
    """Return the measured staircase under the loops of the models."""
    from rtctl.plots.identification import identification_figure

    ends = extract_steady_states(dataset)
    v = ends.current_mA
    second = np.flatnonzero(ends.reset)[1:2]  # the first staircase is drawn: random ones would be a scribble
    scored = ends.scored & (np.arange(len(v)) < (second[0] if len(second) else len(v)))
    models = {
        "GPI / EGPI": (
            -1e3 * model.resistance_gpi.simulate(v)[scored],
            model.deflection_egpi.simulate(v)[scored],
        ),
        "Preisach": (
            np.exp(-model.resistance_preisach.simulate(v)[scored]),
            model.deflection_preisach.simulate(v)[scored],
        ),
    }
    return identification_figure(v[scored], ends.resistance_ohm[scored], ends.deflection_um[scored], models)
