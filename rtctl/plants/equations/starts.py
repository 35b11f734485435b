"""Where a model of equations begins: the start that the fitted records have in common."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.equations.fmu_file import UserModel
from rtctl.identification.fit_record import FitRecord


def with_common_start(
    model: UserModel, states: Sequence[str], records: Sequence[FitRecord], starts: Sequence[FloatArray]
) -> UserModel:
    """Return a model whose `initial` is the median over the records that state none.

    Args:
        model: The model, whose states are in the units of its file.
        states: Names of the states that were fitted.
        records: Fitted records.
        starts: Initial state (states,) of each, in the units of the file.
    """
    tables: dict[str, Any] = dict(model.model.states)
    for k, name in enumerate(states):
        fitted = [
            float(start[k])
            for record, start in zip(records, starts, strict=True)
            if name not in record.stimulus.initial.keys() - record.stimulus.read
        ]
        if not fitted or name not in tables:
            continue
        tables[name] = tables[name].starting_at(float(np.median(fitted)))
    moved: UserModel = model.model_copy(update={"model": model.model.model_copy(update={"states": tables})})
    return moved
