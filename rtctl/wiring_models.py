"""Models and simulations from their files (with `wiring`): which part of which kind of plant reads and runs them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rtctl.border.errors import InputError, nearest
from rtctl.border.simulation import Simulation
from rtctl.orbits.forced import Forced
from rtctl.registry import ModelFiles, mechanisms_of, names, plant_kinds
from rtctl.registry.loading import resolved


def read_model(path: Path, kind: str) -> Any:
    """Return the model of the file `path`, which is of a known kind. Raises InputError."""
    return resolved(_model_files(kind, str(path)).read, f'plant "{kind}"')(path)


def read_class(owner: type) -> Any:
    """Return the model that a class declares. Raises InputError."""
    return resolved("plant_sim.equations.reading:read_class", "model")(owner)


def build_simulation(
    model: Any, units: Mapping[str, str], source: str, kind: str | None = None
) -> Simulation:
    """Return a model bound to the units of a dataset.

    Args:
        model: model as `read_model` returns it.
        units: unit of each signal.
        source: file of the model, for messages.
        kind: kind of plant; None: the model's own `kind`.

    Raises:
        InputError: the model cannot be simulated in these units.
    """
    files = _model_files(kind or str(model.kind), source)
    names("mechanism")  # those of entry points enter the catalogues
    made: Simulation = resolved(files.simulation, source)(model, units, source)
    return made


def _model_files(kind: str, source: str) -> ModelFiles:
    known = {name: one for name, one in plant_kinds().items() if one.model is not None}
    if kind not in known:
        raise InputError(f'{source}: a model of kind "{kind}" cannot be simulated{nearest(kind, known)}')
    files = known[kind].model
    assert files is not None
    return files


def build_forced(model: Any, units: Mapping[str, str], source: str) -> Forced:
    """Return `model` under harmonic drive, bound to `units`. Raises InputError that names `source`, its file."""
    files = _model_files(model.kind, source)
    if files.forced is None:
        raise InputError(f'{source}: a model of kind "{model.kind}" is not driven harmonically')
    made: Forced = resolved(files.forced, source)(model, units, source)
    return made


def mechanism_ids(kind: str) -> tuple[str, ...]:
    """Return the ids of all mechanisms that a kind of plant knows, in the order of its catalogue. Raises InputError."""
    return tuple(mechanisms_of(kind))
