"""What a part must have before it is registered: the members of its protocol, with fitting arguments."""

from __future__ import annotations

import inspect
from typing import Any

from rtctl.border.errors import InputError
from rtctl.border.importing import import_object

PROTOCOLS = {
    "controller": "rtctl.interfaces:Controller",
    "estimator": "rtctl.interfaces:Estimator",
    "driver": "rtctl.border.records:Driver",
    "plant": "plant_sim.plant:Plant",
}
OPTIONAL = frozenset({"preview_s"})
"""Members that the loop does without."""


def check_class(part: str, name: str, value: Any) -> None:
    """Raise InputError where the class `value` lacks a method of its part's protocol, or one takes other arguments.

    Functions that build the part are checked by what they return (`check_instance`).
    """
    if not callable(value):
        raise InputError(
            f'{part} "{name}": a class, or a function that returns its objects, is needed, not {value!r}'
        )
    if not isinstance(value, type):
        return
    protocol = import_object(PROTOCOLS[part], f'{part} "{name}"')
    for method in _methods(protocol):
        own = getattr(value, method, None)
        wanted = _arguments(getattr(protocol, method))
        if not callable(own):
            raise InputError(
                f'{part} "{name}": {value.__qualname__} lacks the method {method}({", ".join(wanted)})'
            )
        if not _accepts(own, getattr(protocol, method)):
            raise InputError(
                f'{part} "{name}": {value.__qualname__}.{method} must take ({", ".join(wanted)}), '
                f"it takes ({', '.join(_arguments(own))})"
            )


def check_instance(part: str, name: str, made: Any) -> None:
    """Raise InputError where the object `made` lacks a member of its part's protocol."""
    protocol = import_object(PROTOCOLS[part], f'{part} "{name}"')
    attributes = [one for one in protocol.__annotations__ if one not in OPTIONAL]
    lacking = [one for one in (*_methods(protocol), *attributes) if not hasattr(made, one)]
    if lacking:
        raise InputError(
            f'{part} "{name}": {type(made).__qualname__} lacks {", ".join(lacking)}; a {part} has '
            f"{', '.join((*_methods(protocol), *attributes))}"
        )


def _methods(protocol: type) -> list[str]:
    return [name for name, member in vars(protocol).items() if inspect.isfunction(member) and name[0] != "_"]


def _arguments(method: Any) -> list[str]:
    """Return the names of a method's arguments, self excluded."""
    try:
        names = list(inspect.signature(method).parameters)
    except (TypeError, ValueError):  # compiled functions do not tell
        return []
    return names[1:] if names[:1] == ["self"] else names


def _accepts(own: Any, declared: Any) -> bool:
    """Whether `own` can be called as the protocol's method `declared` is."""
    try:
        signature = inspect.signature(own)
    except (TypeError, ValueError):
        return True
    parameters = list(inspect.signature(declared).parameters.values())
    if not isinstance(own, type) and list(signature.parameters)[:1] != ["self"]:  # static or bound
        parameters = parameters[1:]
    positional = [one.name for one in parameters if one.kind is one.POSITIONAL_OR_KEYWORD]
    keywords = {one.name: None for one in parameters if one.kind is one.KEYWORD_ONLY}
    try:
        signature.bind(*positional, **keywords)
    except TypeError:
        return False
    return True
