"""Objects of the user's classes: options checked against the constructor, errors as messages, members checked."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any

from rtctl.border.errors import InputError, RtctlError, nearest
from rtctl.registry.checks import check_instance
from rtctl.registry.parts import Entry, load


def option_findings(entry: Entry, options: Mapping[str, Any], offered: frozenset[str]) -> list[str]:
    """Return what is wrong with the names of `options` for the constructor of `entry`; empty: nothing.

    Args:
        entry: own part.
        options: keys of its table, "kind" excluded.
        offered: arguments that the program fills in, which are no options.
    """
    parameters = _parameters(load(entry))
    if parameters is None:
        return []
    known = [name for name in parameters if name not in offered]
    takes_any = any(one.kind is one.VAR_KEYWORD for one in parameters.values())
    findings = [
        f'unknown key "{entry.part}.{name}" of {entry.part} "{entry.name}"{nearest(name, known)}'
        for name in options
        if name not in known and not takes_any
    ]
    findings += [
        f'key "{entry.part}.{name}" of {entry.part} "{entry.name}" is missing'
        for name in known
        if parameters[name].default is inspect.Parameter.empty
        and parameters[name].kind in (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
        and name not in options
    ]
    return findings


def build(entry: Entry, options: Mapping[str, Any], **offered: Any) -> Any:
    """Return an object of the own part `entry`.

    Args:
        entry: own part.
        options: keyword arguments of its constructor, from the file.
        **offered: further ones, each passed where the constructor has an argument of its name.

    Raises:
        InputError: an option is unknown or out of range, the constructor fails, or the object lacks a member.
    """
    factory = load(entry)
    if entry.part == "plant":
        factory = factory.part(factory.device)
    findings = option_findings(entry, options, frozenset(offered))
    if findings:
        raise InputError("\n".join(findings))
    parameters = _parameters(factory) or {}
    passed = {name: value for name, value in offered.items() if name in parameters}
    try:
        made = factory(**passed, **options)
    except RtctlError:
        raise
    except Exception as error:
        kind = "" if isinstance(error, ValueError) else f"{type(error).__name__}: "
        given = ", ".join(f"{name} = {value!r}" for name, value in options.items())
        raise InputError(
            f'{entry.part} "{entry.name}" of {entry.origin} cannot be made'
            f"{f' with {given}' if given else ''}: {kind}{error}"
        ) from error
    check_instance(entry.part, entry.name, made)
    return made


def _parameters(factory: Any) -> dict[str, inspect.Parameter] | None:
    """Return the arguments of a constructor by name; None: it does not tell."""
    from rtctl.registry.plant_kind import PlantKind

    if isinstance(factory, PlantKind):
        factory = factory.part(factory.device)
    try:
        return dict(inspect.signature(factory).parameters)
    except (TypeError, ValueError):
        return None
