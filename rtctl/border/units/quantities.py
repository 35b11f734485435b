"""Numbers with units in files: parsed by pint, checked by pydantic, one message for all that is wrong.

A quantity is written `"1.8 ms"` or `{ value = 1.8, unit = "ms" }`; a bare number is refused, because its unit
would be a guess. `Quantity("s")` makes the annotated type of a field that holds seconds.
"""

from __future__ import annotations

import re
import tomllib
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import pint
from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

from rtctl.border.errors import InputError, nearest

LONGEST_UNIT = 80
"""Characters of a unit; longer texts are none."""
_NO_UNIT = re.compile(r"[^\w\s*/^().+\-%°·×²³¹⁰-⁹⁻]")
"""Characters that pint passes over without a word: it reads `m÷s` as m s."""
_TOWER = re.compile(r"(\*\*|\^)[\s(+-]*[\d.]+[\s)]*(\*\*|\^)|\d{5}|(\*\*|\^)[\s(+-]*\d{3}|\d[eE][+-]?\d{3}")
"""Powers of powers and large numbers, which would be worked out for ever."""
QUANTITY = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?inf|nan)\s*(.*)$")
"""A number and its unit, in one text."""

_SHOWN = 4
"""Files of a folder that a message names."""

ModelT = TypeVar("ModelT", bound=BaseModel)


class Checked(BaseModel):
    """Base of every table that is read from a file: frozen, unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=False)


_KEPT = Path(__file__).parent / "__pycache__" / f"pint-{pint.__version__}"
"""Folder of pint's parsed definitions, beside the program's other compiled files."""


@lru_cache(maxsize=1)
def unit_registry() -> pint.UnitRegistry[float]:
    """Return the one registry of the program; from the definitions kept on the disk, in a fifth of the time."""
    try:
        return pint.UnitRegistry(cache_folder=_KEPT)
    except Exception:  # no place, or damaged: pickle ends in any error
        return pint.UnitRegistry()


def check_unit_text(unit: str) -> None:
    """Raise ValueError for a text that pint would work out for ever, or read as another unit than it says."""
    if len(unit) > LONGEST_UNIT or _NO_UNIT.search(unit) or _TOWER.search(unit):
        raise ValueError(f'unit "{unit[:LONGEST_UNIT]}" cannot be read; write it like "mm/s^2"')


def convert(value: float, unit: str, to: str) -> float:
    """Return `value unit` in `to`. Raises ValueError in words for an unknown or incompatible unit."""
    for text in (unit, to):  # a file may give both
        check_unit_text(text)
    registry = unit_registry()
    try:
        return float(registry.Quantity(value, unit).to(to).magnitude)
    except pint.UndefinedUnitError as error:
        raise ValueError(f'unknown unit "{unit}" (expected one of {to})') from error
    except pint.DimensionalityError as error:
        raise ValueError(f'unit "{unit}" is not compatible with {to}') from error
    except Exception as error:  # "mm)", "??": pint's parser lets out whatever it stumbles on
        raise ValueError(f'"{unit}" is not a unit (expected one of {to})') from error


PLAIN = ("1", "dimensionless")
"""Names of the unit of a plain number."""


def is_angle(unit: str) -> bool:
    """Return whether `unit` is a radian or a part of one; pint takes a count and a percentage for the same dimension.

    Raises ValueError for an unknown unit.
    """
    check_unit_text(unit)
    try:
        return str(unit_registry().get_root_units(unit)[1]) == "radian"
    except pint.UndefinedUnitError as error:
        raise ValueError(f'unknown unit "{unit}"') from error


def parse_quantity(raw: Any, unit: str) -> float:
    """Return a quantity of a file in `unit`; a plain number needs none written. Raises ValueError in words."""
    unit = "" if unit.strip() in PLAIN else unit
    if isinstance(raw, dict):
        if not {"value", "unit"} <= raw.keys() or not isinstance(raw["value"], int | float):
            raise ValueError(f'a quantity is {{ value = <number>, unit = "{unit}" }}, got {raw!r}')
        return convert(float(raw["value"]), str(raw["unit"]), unit)
    if isinstance(raw, bool) or not isinstance(raw, str | int | float):
        raise ValueError(f'a quantity with its unit is needed, such as "1 {unit}", got {raw!r}')
    if isinstance(raw, int | float):
        if unit == "":
            return float(raw)
        raise ValueError(f'{raw!r} has no unit; write "{raw} {unit}"')
    match = QUANTITY.match(raw.strip())
    if match is None:
        raise ValueError(f'a quantity is "<number> <unit>", such as "1 {unit}", got {raw!r}')
    if not match[2] and unit:
        raise ValueError(f'{raw!r} has no unit; write "{raw} {unit}"')
    return convert(float(match[1]), match[2] or "dimensionless", unit or "dimensionless")


def Quantity(unit: str) -> BeforeValidator:
    """Return the annotation of a field in `unit`, such as the second argument of `Annotated[float, ...]`."""
    return BeforeValidator(lambda raw: parse_quantity(raw, unit))


def read_toml(path: Path) -> dict[str, Any]:
    """Return the tables of a TOML file. Raises InputError that names the file."""
    try:
        with path.open("rb") as file:
            return tomllib.load(file)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except IsADirectoryError:
        raise InputError(f"{path}: is a folder, a TOML file is needed{_files_in(path)}") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        if path.suffix.lower() != ".toml":
            raise InputError(
                f"{path}: is no TOML file, as a manifest (dataset.toml), a model or a scenario is"
            ) from None
        raise InputError(f"{path}: not valid TOML: {error}") from None


def _files_in(folder: Path) -> str:
    """Return the TOML files of a folder as the end of a message, a dataset's manifest first."""
    names = sorted(
        (one.name for one in folder.glob("*.toml")), key=lambda name: (name != "dataset.toml", name)
    )
    if not names:
        return ", and it holds none"
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return f"; did you mean {', '.join(str(folder / name) for name in names[:_SHOWN])}{more}?"


def check(
    model: type[ModelT], tables: dict[str, Any], source: str, context: dict[str, Any] | None = None
) -> ModelT:
    """Validate `tables` as a `model`; one InputError has every finding, each with file, key and the nearest valid key.

    `context` is passed to validators that need more than the tables.
    """
    try:
        return model.model_validate(tables, context=context)
    except ValidationError as error:
        items: list[dict[str, Any]] = [dict(item) for item in error.errors()]
        inner = {item["loc"][:-1] for item in items}  # a list whose items are wrong is not also too short
        items = [item for item in items if item["type"] != "too_short" or item["loc"] not in inner]
        lines = [f"{source}: {_finding(model, item)}" for item in items]
        raise InputError("\n".join(dict.fromkeys(lines))) from None


def _finding(model: type[BaseModel], item: dict[str, Any]) -> str:
    where, known = _keys_on(model, item["loc"][:-1])
    last = str(item["loc"][-1]) if item["loc"] else ""
    whole, _ = _keys_on(model, item["loc"])
    key = ".".join(
        [*where, last] if len(whole) > len(where) else where
    )  # a table's own finding ends with its tag
    kind, message, context = item["type"], str(item["msg"]).removeprefix("Value error, "), item.get("ctx", {})
    if kind == "extra_forbidden":
        return f'unknown key "{key}"{nearest(last, known)}'
    if kind == "missing":
        return f'key "{key}" is missing'
    if kind == "union_tag_not_found":
        return f'key "{key}.kind" is missing'
    if kind == "union_tag_invalid":
        known_kinds = context["expected_tags"].replace("'", "")
        return f'key "{key}.kind": unknown kind "{context["tag"]}"; known: {known_kinds}'
    if kind == "literal_error":
        known_values = context["expected"].replace("'", "")
        return f'key "{key}": unknown value {item["input"]!r}; known: {known_values}'
    names_key = message.startswith(('key "', 'unknown key "'))
    return f'key "{key}": {message}' if key and not names_key else message


def _keys_on(model: Any, location: tuple[Any, ...]) -> tuple[list[str], list[str]]:
    """Return the keys of the path to `location` below `model`, as the file has them, and the valid keys there.

    A union's location names the member by its tag, which is no key of the file.
    """
    candidates, where = _models_in(model), []
    for part in location:
        named = [m for m in candidates if _tag_of(m) == part] if len(candidates) > 1 else []
        if named:
            candidates = named
            continue
        where.append(str(part))
        inner: list[type[BaseModel]] = []
        for candidate in candidates:
            field = _fields(candidate).get(str(part))
            inner += _models_in(field) if field is not None else []
        candidates = inner or candidates
    return where, sorted({name for candidate in candidates for name in _fields(candidate)})


def _fields(model: type[BaseModel]) -> dict[str, Any]:
    return {(info.alias or name): info.annotation for name, info in model.model_fields.items()}


def _tag_of(model: type[BaseModel]) -> str | None:
    tag = getattr(model, "union_tag", None)  # of a table that several kinds share
    if isinstance(tag, str):
        return tag
    kind = model.model_fields.get("kind")
    return str(kind.default) if kind is not None else None


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for arg in getattr(annotation, "__args__", ()) for model in _models_in(arg)]
