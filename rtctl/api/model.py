"""A model of one device: parameters with units, mechanisms, the file that it came from."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.api.inputs import path_of
from rtctl.border.errors import InputError
from rtctl.output.notebook import html_table, number


class Parameter(NamedTuple):
    """One number of a model, with its unit and what a fit knows of it."""

    value: float
    unit: str
    standard_error: float | None = None
    """Standard error of the value, in its unit; None where no fit gave one."""
    low: float | None = None
    """Lower end of the interval in which the value is believed to lie."""
    high: float | None = None
    """Upper end of that interval."""
    fixed: bool = False
    """Whether a fit leaves it as it is."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Model:
    """A model as `read_model`, `identify` and `diagnose` give it."""

    kind: str
    """Kind of plant, such as "oscillator" or "vo2"."""
    content: Any
    """The kind's own record, which estimators, controllers and simulations take."""
    source: Path | None = None
    """The file that it was read from or written to."""

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Parameters by name; those of a mechanism as `mechanism.id.parameter`."""
        tables = self._tables()
        listed = {name: _parameter(table) for name, table in tables.get("parameters", {}).items()}
        for mechanism in tables.get("mechanisms", ()):
            for name, table in mechanism.get("parameters", {}).items():
                listed[f"{mechanism['id']}.{name}"] = _parameter(table)
        return listed

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of each parameter, by its name."""
        return {name: parameter.unit for name, parameter in self.parameters.items()}

    @property
    def mechanisms(self) -> tuple[str, ...]:
        """Ids of the mechanisms that extend the nominal model."""
        return tuple(str(table["id"]) for table in self._tables().get("mechanisms", ()))

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the model file, whole or not at all, and return its path."""
        target = path_of("path", path)
        _write(self.kind, self.content, target)
        return target

    @contextmanager
    def file(self) -> Iterator[Path]:
        """Yield the model's file: its source, or a temporary one of a model that was never written."""
        if self.source is not None:
            yield self.source
            return
        with tempfile.TemporaryDirectory(prefix="rtctl-") as folder:
            yield self.save(Path(folder) / "model.toml")

    def _tables(self) -> dict[str, Any]:
        """Return the table [model] of the file; an empty one of a kind whose models have no parameters with units."""
        if self.kind == "vo2":
            from rtctl.models.vo2 import model_tables

            tables: dict[str, Any] = model_tables(self.content)["model"]
            return tables
        from rtctl.border.equations.file import EquationsFile
        from rtctl.border.equations.fmu_file import FmuFile
        from rtctl.border.model_file import ModelFile

        has_units = isinstance(self.content, ModelFile | EquationsFile | FmuFile)
        return self.content.model.model_dump(exclude_none=True) if has_units else {}

    def __repr__(self) -> str:
        extended = f", extended by {', '.join(self.mechanisms)}" if self.mechanisms else ""
        origin = "" if self.source is None else f", from {self.source}"
        return f"<Model ({self.kind}), {len(self.parameters)} parameters{extended}{origin}>"

    def _repr_html_(self) -> str:
        rows = [
            [name, number(one.value), number(one.standard_error), one.unit]
            for name, one in self.parameters.items()
        ]
        title = f"Model ({self.kind})"
        return html_table(title, ["parameter", "value", "standard error", "unit"], rows)


def read_model(path: str | PathLike[str] | type) -> Model:
    """Read a model file of any kind of plant, or a class that declares a device (docs/python-device.md).

    Raises:
        InputError: The file is missing, is no model, or a key or unit of it is wrong, or the class declares no device;
            all findings at once.
    """
    from rtctl.models.kinds import model_kind
    from rtctl.wiring_models import read_class
    from rtctl.wiring_models import read_model as read_content

    if isinstance(path, type):
        return Model(kind="equations", content=read_class(path))
    file = path_of("model", path)
    kind = model_kind(file)
    return Model(kind=kind, content=read_content(file, kind), source=file)


def model_of(model: Model | str | PathLike[str]) -> Model:
    """Return `model`, read from its file where it is a path. Raises InputError."""
    return model if isinstance(model, Model) else read_model(model)


@contextmanager
def file_of(model: Model | str | PathLike[str] | None) -> Iterator[Path | None]:
    """Yield the file of `model`, a temporary one of a model that was never written; None of None. Raises InputError."""
    if not isinstance(model, Model):
        yield None if model is None else path_of("model", model)
        return
    with model.file() as file:
        yield file


def kind_of(model: Model | str | PathLike[str]) -> str:
    """Return the kind of `model`, of a file before anything else in it is read. Raises InputError."""
    from rtctl.models.kinds import model_kind

    return model.kind if isinstance(model, Model) else model_kind(path_of("model", model))


def _write(kind: str, content: Any, path: Path) -> None:
    from rtctl.registry import plant_kind

    record = plant_kind(kind, "model.kind")
    if record.model is None or record.model.write is None:
        raise InputError(f'{path}: models of a "{kind}" cannot be written')
    path.parent.mkdir(parents=True, exist_ok=True)
    record.part(record.model.write)(path, content)


def _parameter(table: Mapping[str, Any]) -> Parameter:
    return Parameter(**{key: table[key] for key in Parameter._fields if key in table})
