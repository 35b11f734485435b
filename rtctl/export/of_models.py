"""What a model is to other programs, by its kind of plant: C source, differential equations."""

from __future__ import annotations

from typing import Any

from rtctl.border.errors import InputError
from rtctl.border.exported.c_plant import CPlant, CRequest
from rtctl.border.exported.dynamics import Dynamics
from rtctl.registry import plant_kinds
from rtctl.registry.loading import resolved


def build_c_plant(model: Any, source: str, kind: str, request: CRequest) -> CPlant:
    """Return a model as C source.

    Args:
        model: Model as its kind's reader returns it.
        source: File of the model, for messages.
        kind: Kind of plant.
        request: What is asked of it.

    Raises:
        InputError: The model, or a part of it, has no form in C; it is named.
    """
    made: CPlant = _part(kind, "c_plant", source, "has no C source to be exported as a unit or program")(
        model, source, request
    )
    return made


def build_dynamics(model: Any, source: str, kind: str, branch: str | None) -> Dynamics:
    """Return a model as differential equations.

    Args:
        model: Model as its kind's reader returns it.
        source: File of the model, for messages.
        kind: Kind of plant.
        branch: Branch of a hysteretic plant, "rising" or "falling"; None: that of the kind, or it has none.

    Raises:
        InputError: The model is no differential equation; the part that is none is named.
    """
    make = _part(kind, "dynamics", source, "is no differential equation")
    made: Dynamics = make(model, source) if branch is None else make(model, source, branch)
    return made


def build_matlab_function(model: Any, source: str, kind: str, name: str) -> str:
    """Return a model as the source of a MATLAB function `name`. Raises InputError where it has no such form."""
    refusal = (
        "has no form as a MATLAB function; export it as a unit (rtctl export fmu), which Simulink imports"
    )
    made: str = _part(kind, "matlab_function", source, refusal)(model, source, name)
    return made


def _part(kind: str, word: str, source: str, refusal: str) -> Any:
    """Return a part of the model files of a kind. Raises InputError where it has none."""
    files = plant_kinds()[kind].model if kind in plant_kinds() else None
    part = None if files is None else getattr(files, word)
    if part is None:
        raise InputError(f'{source}: a model of kind "{kind}" {refusal}')
    return resolved(part, source)
