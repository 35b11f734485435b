"""Measured data to a model: `identify`."""

from __future__ import annotations

from typing import Any

from rtctl.api.datasets import dataset_of
from rtctl.api.fit import Fit
from rtctl.api.inputs import PathText, path_of
from rtctl.api.model import Model, model_of
from rtctl.border.errors import InputError, nearest
from rtctl.measured.dataset import Dataset
from rtctl.output.progress import Progress, reporter

KINDS = ("oscillator", "vo2")
"""Kinds of plant that can be identified."""


# 8 parameters because each is an option of the command line
def identify(
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
        kind: "oscillator" or "vo2"; None: the dataset's own.
        model: Of an oscillator, where to start, which parameters are fixed, its mechanisms; None: the nominal four.
        starts: Starts of each fit, 1 to 64; None: 6 of an oscillator, 14 of a vo2.
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
    if kind is not None:
        options = _options(kind, given, model)  # wrong options are known before any data are read
        data = dataset_of(dataset)
        _check_kind(kind, data)
    else:
        data = dataset_of(dataset)
        options = _options(data.plant, given, model)
    if data.plant == "vo2":
        from rtctl.api.fit_vo2 import fit_vo2

        return fit_vo2(data, options, report)
    from rtctl.api.fit_oscillator import fit_oscillator

    start = None if model is None else model_of(model)
    if start is not None and start.kind != data.plant:
        raise InputError(
            f'{start.source or "model"}: a model of a "{start.kind}", the data are of a "{data.plant}"'
        )
    return fit_oscillator(data, start, options, report)


def _options(kind: str, given: dict[str, int | None], model: Model | PathText | None) -> Any:
    """Return the kind's options. Raises InputError for one that is out of its limits or of another kind of plant."""
    if kind == "oscillator":
        from rtctl.identification.oscillator.identify import OscillatorFitOptions

        for name in ("plays", "cells"):
            if given[name] is not None:
                raise InputError(
                    f"{name} {given[name]}: an option of a vo2, and this is an oscillator; leave it out"
                )
        return OscillatorFitOptions(**_set(given, {"starts": "starts", "seed": "seed"}))
    if kind == "vo2":
        from rtctl.identification.vo2.identify import Vo2FitOptions

        if model is not None:
            name = str((model.source or "") if isinstance(model, Model) else path_of("model", model))
            raise InputError(f"model {name}: a vo2 is identified from its data alone; leave it out")
        names = {"starts": "starts", "seed": "seed", "plays": "plays", "cells": "fine_cells"}
        return Vo2FitOptions(**_set(given, names))
    raise InputError(f'kind: nothing identifies a "{kind}"{nearest(str(kind), KINDS)}')


def _set(given: dict[str, int | None], names: dict[str, str]) -> dict[str, Any]:
    """Return the options that are not None under the names of their record."""
    return {field: given[name] for name, field in names.items() if given[name] is not None}


def _check_kind(kind: str, dataset: Dataset) -> None:
    if dataset.plant != kind:
        raise InputError(
            f'{dataset.path}: key "dataset.plant" is "{dataset.plant}", kind "{kind}" was asked for; leave it out'
        )
