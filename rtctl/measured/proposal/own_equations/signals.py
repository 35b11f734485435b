"""The signals of a dataset of equations: those that the model file names, or those of --input and --output."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

from rtctl.border.equations.file import KIND, EquationsFile
from rtctl.border.errors import InputError
from rtctl.border.units.quantities import check, read_toml
from rtctl.measured.manifest.signal_kinds import measured_kinds
from rtctl.measured.proposal.given import NONE, column_and_unit
from rtctl.measured.proposal.naming.column_names import bare_name, read_name
from rtctl.measured.proposal.proposal import Answers, ModelSignals
from rtctl.registry import PlantKind, SignalKind, plant_kind


def read_model_signals(path: Path) -> ModelSignals:
    """Return which kind of plant a model file is of and, of equations, its inputs and outputs with their units.

    Raises:
        InputError: There is no such file, or it is no model of a kind that has datasets.
    """
    if path.suffix.lower() == ".fmu":
        return _of_device(path, "fmu")
    tables = read_toml(path)
    table = tables.get("model")
    kind = table.get("kind") if isinstance(table, dict) else None
    if kind not in measured_kinds():
        raise InputError(
            f'--model {path}: key "model.kind" is {kind!r}; a model file is needed, of one of '
            f"{', '.join(measured_kinds())}"
        )
    if not plant_kind(str(kind)).free_signals:
        return ModelSignals(path=path, plant=str(kind))
    if kind != KIND and plant_kind(str(kind)).device_profile is not None:
        return _of_device(path, str(kind))
    if kind != KIND:
        raise InputError(
            f'--model {path}: the signals of a model of kind "{kind}" cannot be read from its file; say '
            f"--plant {kind}, and --input NAME=COLUMN[:UNIT] and --output NAME=COLUMN[:UNIT]"
        )
    model = check(EquationsFile, tables, str(path)).model
    return ModelSignals(
        path=path, plant=KIND,
        inputs={name: one.unit for name, one in model.inputs.items()},
        outputs={name: one.unit for name, one in model.outputs.items()},
    )  # fmt: skip


def _of_device(path: Path, kind: str) -> ModelSignals:
    """Return the signals of a model whose file names the channels of a device."""
    record = plant_kind(kind)
    profile = record.part(record.device_profile)(path)
    return ModelSignals(
        path=path, plant=kind,
        inputs={one.name: one.unit for one in profile.commands},
        outputs={one.name: one.unit for one in profile.sensed},
    )  # fmt: skip


def with_named_signals(answers: Answers, columns: Collection[str]) -> Answers:
    """Return the answers in which each --input and --output has a name: without one, it is the column's.

    Raises:
        InputError: There is no such column.
    """
    return replace(
        answers,
        inputs=tuple(_named(text, columns, "--input") for text in answers.inputs),
        outputs=tuple(_named(text, columns, "--output") for text in answers.outputs),
    )


def with_signals(plant: PlantKind, answers: Answers) -> PlantKind:
    """Return a kind of plant that has no signals of its own with those of the model, or with those that were named."""
    if answers.model is not None:
        found = {
            name: SignalKind(role=role, like=unit)
            for role, units in (("input", answers.model.inputs), ("output", answers.model.outputs))
            for name, unit in units.items()
        }
    else:
        found = {
            text.partition("=")[0].strip(): SignalKind(role=role)
            for role, texts in (("input", answers.inputs), ("output", answers.outputs))
            for text in texts
        }
    return replace(plant, signals=found)


def signal_name(column: str) -> str:
    """Return the name of a signal after its column: `log.U_heater_V` is U_heater, `T plate [degC]` is T_plate."""
    last = column if "[" in column or "(" in column else column.rpartition(".")[2]
    name = bare_name(last)
    unit = read_name(last).unit
    words = [one for one in re.split(r"\W+", name) if one]
    name = "_".join(words)
    if unit and name.lower().endswith(f"_{unit.lower()}"):
        name = name[: -len(unit) - 1]
    return f"x{name}" if not name or name[0].isdigit() else name


def _named(text: str, columns: Collection[str], option: str) -> str:
    name, equals, rest = text.partition("=")
    if equals and text not in columns and re.fullmatch(r"\s*[A-Za-z_]\w*\s*", name):
        column = column_and_unit(rest.strip(), columns, option)
        if column.column == NONE:
            raise InputError(f"{option} {text}: name a column; a signal that is not there is not told")
        return text
    return f"{signal_name(column_and_unit(text, columns, option).column)}={text}"
