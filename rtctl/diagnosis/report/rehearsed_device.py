"""The simulated device on which a next experiment is rehearsed: a model file, without what no device can have."""

from __future__ import annotations

from pathlib import Path

from rtctl.border.errors import InputError, NoStreamError
from rtctl.border.units.quantities import read_toml
from rtctl.models.provenance import write_model_file
from rtctl.registry import plant_kind

LEFT_OUT = "left_out"
"""Key of `[provenance]` with the mechanisms that the device lacks and the diagnosed model has."""


def mechanisms_without_device(model: Path, kind: str) -> tuple[str, ...]:
    """Return the mechanisms of a model file that have no form for a device that runs sample by sample."""
    record = plant_kind(kind)
    if record.device_file is None:
        return ()
    try:
        record.part(record.device_file)(model, None)
    except NoStreamError as error:
        return error.mechanisms
    except InputError:  # no device at all, which an acquisition says in its own words
        return ()
    return ()


def write_without_mechanisms(model: Path, to: Path, left_out: tuple[str, ...]) -> None:
    """Write a model file without some of its mechanisms, which its provenance then names."""
    tables = read_toml(model)
    kept = [one for one in tables["model"]["mechanisms"] if one["id"] not in left_out]
    found = {
        **tables,
        "model": {**tables["model"], "mechanisms": kept},
        "provenance": {**tables.get("provenance", {}), LEFT_OUT: list(left_out)},
    }
    write_model_file(to, found, found["provenance"])


def left_out_of(model: Path) -> tuple[str, ...]:
    """Return the mechanisms that a device's model file leaves out of the model that was diagnosed."""
    provenance = read_toml(model).get("provenance", {})
    listed = provenance.get(LEFT_OUT, ()) if isinstance(provenance, dict) else ()
    return tuple(str(one) for one in listed) if isinstance(listed, list) else ()
