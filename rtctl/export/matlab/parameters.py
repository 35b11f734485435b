"""Parameters of a model to and from a .mat file.

The file has a struct `model`: `kind`, `parameters.NAME.value` and `.unit` (points in a name become underscores), and
`toml`, the whole model file as text, so that nothing is lost on the way: what is read back is that text with the values
that stand in `parameters` now.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, savemat

from rtctl.border.errors import InputError
from rtctl.output.atomic_write import replacing
from rtctl.output.own_files import mark_of

LONGEST_NAME = 63
"""Characters of a MATLAB name."""


def field_names(names: Iterable[str], source: str) -> dict[str, str]:
    """Return the MATLAB name of each parameter. Raises InputError, which names `source`, where two are the same."""
    fields: dict[str, str] = {}
    for name in names:
        field = re.sub(r"\W", "_", name)[:LONGEST_NAME]
        if field in fields.values():
            raise InputError(f'{source}: two parameters would have the MATLAB name "{field}"; rename one')
        fields[name] = field
    return fields


def write_mat(path: Path, kind: str, parameters: Mapping[str, tuple[float, str]], toml: str) -> None:
    """Write a .mat file (version 5), whole or not at all.

    Args:
        path: The file.
        kind: Kind of plant.
        parameters: Value and unit of each parameter.
        toml: Text of the model file.
    """
    fields = field_names(parameters, str(path))
    structs = {fields[name]: {"value": value, "unit": unit} for name, (value, unit) in parameters.items()}
    model = {"kind": kind, "parameters": structs or np.zeros((0, 0)), "toml": toml}
    with replacing(path, "save_mat") as partial:
        savemat(str(partial), {"model": {**model, "program": mark_of("save_mat")}}, appendmat=False)


def read_mat(path: Path) -> dict[str, Any]:
    """Return the tables of the model file in a .mat file, with the values that stand in its `parameters`.

    Raises:
        InputError: The file is missing or no .mat file of a model, a value is no number, or a unit was changed.
    """
    try:
        model = loadmat(path, simplify_cells=True)["model"]
        tables = tomllib.loads(str(model["toml"]))
        given = model["parameters"]
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except Exception as error:  # SciPy lets out whatever it stumbles on
        raise InputError(f"{path}: it is no .mat file that rtctl wrote of a model: {error}") from None
    found = dict(_places(tables["model"]))
    fields = field_names(found, str(path))
    lines = []
    for name, table in found.items():
        one = given.get(fields[name]) if isinstance(given, dict) else None
        if one is None:
            lines.append(f"{path}: model.parameters.{fields[name]} is missing")
            continue
        value = np.asarray(one["value"])
        if value.size != 1 or value.dtype.kind not in "fiu" or not np.isfinite(value).all():
            lines.append(
                f"{path}: model.parameters.{fields[name]}.value must be one finite number, got {one['value']!r}"
            )
        elif str(one["unit"]) != table["unit"]:
            lines.append(
                f'{path}: model.parameters.{fields[name]}.unit is "{one["unit"]}", the model file has '
                f'"{table["unit"]}"; convert the value and leave the unit'
            )
        else:
            table["value"] = float(value.reshape(-1)[0])
    if lines:
        raise InputError("\n".join(lines))
    return tables


def _places(model: Mapping[str, Any]) -> Iterable[tuple[str, dict[str, Any]]]:
    """Yield name and table of each parameter with a value and a unit, those of a mechanism as `id.name`."""
    for name, table in model.get("parameters", {}).items():
        yield name, table
    for mechanism in model.get("mechanisms", ()):
        for name, table in mechanism.get("parameters", {}).items():
            yield f"{mechanism['id']}.{name}", table
