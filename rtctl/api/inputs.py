"""What a call accepts: paths as text or Path, scenarios as files, names or tables, parts by kind or as objects."""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeAlias

from rtctl.border.errors import InputError, check_utf8

if TYPE_CHECKING:
    from rtctl.border.records import Driver
    from rtctl.scenario.schema import Scenario

PathText: TypeAlias = str | PathLike[str]
"""A path: a text, a `pathlib.Path`, or what names its file itself, such as a saved `Fit`."""
PartTable: TypeAlias = Literal["driver", "estimator", "controller"]
"""Table of a scenario that a part of the user's own stands in."""
Settings: TypeAlias = Mapping[str, Any] | Sequence[str]
"""Keys of a scenario to override: `{"driver.kind": "modbus-tcp"}`, or texts `"driver.kind=modbus-tcp"`."""


def path_of(name: str, value: Any) -> Path:
    """Return the path of an argument `name`. Raises InputError where it is neither text nor a path."""
    if isinstance(value, bytes) or not isinstance(value, str | PathLike):
        raise InputError(
            f"{name} must be a path (a text or pathlib.Path), got {type(value).__name__} {value!r:.60}"
        )
    check_utf8(value)
    return Path(os.fspath(value))


class LoadedScenario(NamedTuple):
    """A checked scenario and where it came from."""

    scenario: Scenario
    tables: dict[str, Any]
    """As it is run, overrides included."""
    folder: Path
    """Where files that it names are looked up first."""
    name: str
    """Name of its file, without suffix."""


def load_scenario(
    scenario: PathText | Mapping[str, Any], settings: Settings, parts: Mapping[PartTable, Any] | None = None
) -> LoadedScenario:
    """Return the checked scenario of a file, of a bundled name, or of tables, with overrides applied.

    Args:
        scenario: The file, the bundled name, or the tables.
        settings: Overrides by the user.
        parts: Further overrides: "driver", "estimator", "controller" as `run` takes them; None: as it is.

    Raises:
        InputError: No such scenario (the nearest name is offered), or keys, values or units are wrong.
    """
    from rtctl.scenario import schema
    from rtctl.scenario.bundled import find_scenario

    overrides = override_texts(settings)
    for table, part in (parts or {}).items():
        overrides += [] if part is None else override_texts(_part_settings(table, part))
    if not isinstance(scenario, Mapping):
        path = find_scenario(str(path_of("scenario", scenario)))
        checked, tables = schema.load_scenario(path, overrides)
        return LoadedScenario(checked, tables, path.parent, path.stem)
    tables = schema.overridden(copy.deepcopy(dict(scenario)), overrides)
    if isinstance(driver := tables.setdefault("driver", {}), dict):
        driver.setdefault("kind", "inprocess")
    return LoadedScenario(schema.checked_scenario(tables, "scenario"), tables, Path(), "scenario")


def override_texts(settings: Settings) -> list[str]:
    """Return `settings` as KEY=VALUE texts, values as TOML has them."""
    if isinstance(settings, str):
        return [settings]
    if isinstance(settings, Mapping):
        return [text for key, value in settings.items() for text in _assignments(str(key), value)]
    if isinstance(settings, Sequence) and all(isinstance(text, str) for text in settings):
        return list(settings)
    raise InputError(
        f'settings must be a mapping such as {{"driver.kind": "modbus-tcp"}}, got {type(settings).__name__}'
    )


def _assignments(key: str, value: Any) -> list[str]:
    import tomli_w

    if isinstance(value, Mapping):
        return [text for inner, entry in value.items() for text in _assignments(f"{key}.{inner}", entry)]
    if isinstance(value, PathLike):
        value = os.fspath(value)
    if hasattr(value, "tolist"):  # numbers and arrays of NumPy
        value = value.tolist()
    try:
        return [f"{key}={tomli_w.dumps({'value': value}).removeprefix('value = ').strip()}"]
    except TypeError:
        raise InputError(f"settings: {key} = {value!r} is nothing that a scenario can hold") from None


def _part_settings(table: PartTable, part: Any) -> dict[str, Any]:
    """Return the overrides that put a part into a scenario: by its kind, a table of its keys, a class or an object.

    Args:
        table: "driver", "estimator" or "controller".
        part: Its kind, such as "modbus-tcp"; keys such as `{"kind": "pi", "kp": "0.02 mA/um"}`; a class of the
            user's, alone or as "kind" of such keys; or an object of one.

    Raises:
        InputError: `part` is none of these, or lacks a method of its part's protocol.
    """
    if isinstance(part, Mapping):
        keys = dict(part)
        if "kind" in keys and not isinstance(keys["kind"], str):
            keys["kind"] = _registered_name(table, keys["kind"])
        return {f"{table}.{key}": value for key, value in keys.items()}
    return {f"{table}.kind": part if isinstance(part, str) else _registered_name(table, part)}


def _registered_name(table: PartTable, part: Any) -> str:
    """Return the name of a class, function or object of the user's, registered for this session where it has none.

    Raises:
        InputError: It lacks a method of its part's protocol.
    """
    from rtctl.registry import entries, register
    from rtctl.registry.checks import check_instance

    for entry in entries(table):
        if entry.value is part:
            return entry.name
    if callable(part) and hasattr(part, "__qualname__"):
        name = f"{part.__module__}.{part.__qualname__}"
        register(table, name, part)
        return name
    name = f"{type(part).__module__}.{type(part).__qualname__}"
    try:
        check_instance(table, name, part)
    except InputError as error:
        raise InputError(
            f"{table} must be a kind (a text), a mapping of its keys, or a class or an object of your own, got "
            f"{type(part).__name__} {part!r:.60}: {error}"
        ) from None
    name = f"{name} at {id(part):#x}"
    register(table, name, lambda: part, summary=f"an object of {type(part).__qualname__}")
    return name


def driver_of(driver: Any) -> Driver | None:
    """Return `driver` where it is an object with the methods of a driver; None where it names one."""
    methods = ("open", "exchange", "close", "profile")
    is_object = not isinstance(driver, type) and all(hasattr(driver, name) for name in methods)
    return driver if is_object else None
