"""Measured data to a model: `identify`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rtctl.api.datasets import dataset_of
from rtctl.api.identifying.fit import Fit
from rtctl.api.identifying.spikes import Cleaned, without_spikes
from rtctl.api.inputs import PathText, path_of
from rtctl.api.model import Model, model_of
from rtctl.border.errors import InputError, nearest
from rtctl.measured.dataset import Dataset
from rtctl.output.progress import Progress, reporter
from rtctl.registry import Identification, PlantKind, plant_kinds

INCOMPLETE = (
    "the dataset is incomplete, because its acquisition ended early ({}): this model knows nothing of what the missing "
    "records would have shown; acquire it again before you use the model"
)


# 8 parameters because each is an option of the command line
def identify(  # noqa: PLR0913
    dataset: Dataset | PathText,
    *,
    kind: str | None = None,
    model: Model | PathText | None = None,
    starts: int | None = None,
    seed: int = 0,
    plays: int | None = None,
    cells: int | None = None,
    progress: Progress = False,
) -> Fit:
    """Identify a model from a dataset.

    Args:
        dataset: A dataset or its manifest; its records with use "fit" or "identify" are fitted, "test" never.
        kind: "oscillator", "vo2" or "equations"; None: the dataset's own.
        model: Of an oscillator, where to start, which parameters are fixed, its mechanisms; None: the nominal four. Of
            equations, which need one, the equations, bounds and where to start.
        starts: Starts of each fit, 1 to 64; None: 14 of a vo2, else 6.
        seed: Seed of the random starts, 0 or more.
        plays: Of a vo2, play operators a model, 1 to 64 (None: 6).
        cells: Of a vo2, cells along an edge of the fine Preisach models, 8 to 80 (None: 80).
        progress: True shows what is under way, a callable hears (text, share that is done or None).

    Raises:
        InputError: A file or an option is wrong, or the data do not determine anything.
        FitError: No start leads anywhere.
    """
    report = reporter(progress)
    given = {"starts": starts, "seed": seed, "plays": plays, "cells": cells}
    asked = {name: value for name, value in given.items() if value is not None}
    # where the kind is given, wrong options are known before any data are read
    data = dataset_of(dataset) if kind is None else None
    record, how = _identification(str(kind) if data is None else data.plant)
    options = _options(record, how, asked)
    if model is not None and not how.takes_model:
        source = (model.source or "") if isinstance(model, Model) else path_of("model", model)
        raise InputError(f"model {source}: a {record.name} is identified from its data alone; leave it out")
    if data is None:
        data = dataset_of(dataset)
        _check_kind(record.name, data)
    start = None if model is None else model_of(model)
    if start is not None and start.kind != data.plant:
        raise InputError(
            f'{start.source or "model"}: a model of kind "{start.kind}", the data are of a plant "{data.plant}"'
        )
    data, spikes = without_spikes(data) if how.takes_model else Cleaned(data, ())
    fit: Fit = record.part(how.fit)(data, start, options, report)
    for remark in reversed((*data.remarks, *spikes)):
        fit = fit.warn(remark)
    return fit.warn(INCOMPLETE.format(data.incomplete)) if data.incomplete else fit


def _identification(kind: str) -> tuple[PlantKind, Identification]:
    """Return the record of a kind of plant, and how it is identified. Raises InputError where nothing identifies it."""
    kinds = plant_kinds().values()
    known = {one.name: (one, one.identification) for one in kinds if one.identification is not None}
    if kind not in known:
        raise InputError(f'kind: nothing identifies a "{kind}"{nearest(kind, known)}')
    return known[kind]


def _options(record: PlantKind, how: Identification, asked: Mapping[str, int]) -> Any:
    """Return the kind's options. Raises InputError for one that is out of its limits or of another kind of plant."""
    names = how.option_names
    for name, value in asked.items():
        if name not in names:
            known = ", ".join(names)
            raise InputError(
                f'{name} {value}: no option of kind "{record.name}", which has {known}; leave it out'
            )
    return record.part(how.options)(**{names[name]: value for name, value in asked.items()})


def _check_kind(kind: str, dataset: Dataset) -> None:
    if dataset.plant != kind:
        raise InputError(
            f'{dataset.path}: key "dataset.plant" is "{dataset.plant}", kind "{kind}" was asked for; leave it out'
        )
