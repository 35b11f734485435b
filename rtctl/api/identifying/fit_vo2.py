"""A VO2 actuator's dataset to a `Fit`: hysteresis read-outs and heating, and what the staircases lack."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtctl.api.identifying.fit import Fit
from rtctl.api.model import Model
from rtctl.identification.vo2.coarse_loops import describe_improvement, find_coarse_loops
from rtctl.identification.vo2.identify import Vo2FitOptions, identify_vo2
from rtctl.identification.vo2.staircase import estimate_unsettled_share, extract_steady_states
from rtctl.measured.dataset import Dataset
from rtctl.models.vo2 import Vo2Model
from rtctl.output.progress import Reporter
from rtctl.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TOO_COARSE = (
    "the static loops are too coarse, relays switch together: of the staircases, as many cells placed where they do "
    "leave {}; rtctl diagnose learns them anew where records to fit show where they switch"
)
STILL_MOVING = 0.02
"""Largest share of a step that the last sample of a hold may bring.

The share of a first-order heating is known (up to 1.3 % on the bundled devices), the one of a delay is not.
"""
UNSETTLED = (
    "at the ends of the holds of record {} a sample still brings {:.1%} of a step: the loops identified from it are "
    'off by several times that; hold longer, such as --set "excitation.0.hold=30 ms" of rtctl acquire'
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
    warnings = notes_of(model, dataset)
    quality = {name: one._asdict() for name, one in model.quality.items()}
    shown = {output: model.quality[name] for name, output in SHOWN.items() if name in model.quality}
    return Fit(
        model=Model(kind="vo2", content=model),
        dataset=dataset.name,
        method=f"hysteresis read-outs and heating of {model.identity or 'the device'}",
        residual_rms={output: one.rms for output, one in shown.items()},
        units={output: one.unit for output, one in shown.items()},
        trusted=True,
        warnings=warnings,
        result=model,
        _summary={"quality": quality, "warnings": list(warnings)},
        _draw=lambda: staircase_figure(dataset, model),
    )


def notes_of(model: Vo2Model, dataset: Dataset) -> tuple[str, ...]:
    """Return warnings of loops that are too coarse, and of records whose holds were too short."""
    coarse = find_coarse_loops(model, dataset)
    notes = [TOO_COARSE.format(describe_improvement(coarse))] if coarse else []
    for record in dataset.used_for("identify"):
        if (share := estimate_unsettled_share(record)) > STILL_MOVING:
            notes.append(UNSETTLED.format(record.name, share))
    return tuple(notes)


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
