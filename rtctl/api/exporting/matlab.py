"""Models to and from MATLAB: `save_mat`, `read_mat`, `save_matlab_function`."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from rtctl.api.inputs import PathText, path_of
from rtctl.api.model import Model, model_of, read_model
from rtctl.border.errors import InputError
from rtctl.output.atomic_write import replacing
from rtctl.output.own_files import mark_of


def save_mat(model: Model | PathText, out: PathText) -> Path:
    """Write a model's parameters as a .mat file, which holds the whole model file too; return its path.

    In MATLAB: `load beam.mat; model.parameters.stiffness.value = 9000; save('beam.mat', 'model')`.

    Raises:
        InputError: The model is wrong, or two parameters would have one name in MATLAB.
    """
    from rtctl.export.matlab.parameters import write_mat

    target, content = path_of("out", out), model_of(model)
    with content.file() as file:
        text = file.read_text(encoding="utf-8")
    parameters = {name: (one.value, one.unit) for name, one in content.parameters.items()}
    write_mat(target, content.kind, parameters, text)
    return target


def read_mat(path: PathText) -> Model:
    """Return the model of a .mat file that `save_mat` wrote, with the values that stand in it now.

    Raises:
        InputError: It is no such file, a value is no number, a unit was changed, or the model is wrong then.
    """
    import tomli_w

    from rtctl.export.matlab.parameters import read_mat as read_tables

    file = path_of("path", path)
    tables = read_tables(file)
    with tempfile.TemporaryDirectory(prefix="rtctl-") as folder:
        plain = Path(folder) / f"{file.stem}.toml"
        plain.write_text(tomli_w.dumps(tables), encoding="utf-8")
        made = read_model(plain)
    return Model(kind=made.kind, content=made.content)


def save_matlab_function(model: Model | PathText, out: PathText) -> Path:
    """Write a model's equations as a MATLAB function `[dx, y] = NAME(t, x, u, p)`, also for Octave; return its path.

    Args:
        model: A model of kind "equations", or its file.
        out: The file NAME.m; NAME is that of the function.

    Raises:
        InputError: The model is of another kind, has events or a mechanism that is no term of its equations, or the
            name is none of MATLAB.
    """
    from rtctl.export.of_models import build_matlab_function

    target, content = path_of("out", out), model_of(model)
    if target.suffix != ".m" or not re.fullmatch(r"[A-Za-z]\w{0,62}", target.stem, re.ASCII):
        raise InputError(
            f"{target}: a MATLAB function is a file NAME.m, NAME of letters, digits and _, a letter first"
        )
    source = str(content.source or "the model")
    text = build_matlab_function(content.content, source, content.kind, target.stem)
    with replacing(target, "save_matlab_function") as partial:
        partial.write_text(f"{text}\n% Written by {mark_of('save_matlab_function')}\n", encoding="utf-8")
    return target
