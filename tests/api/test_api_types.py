"""Every type that a public function, method or attribute takes or returns has a public name."""

from __future__ import annotations

import ast
import importlib
import inspect
import sys
import types
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ForwardRef, NamedTuple

import pytest

import rtctl

REFERENCE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "index.md"
PACKAGES = ("rtctl", "plant_sim", "drivers")
INNER = (rtctl.Answer, rtctl.Dynamics, rtctl.Proposal, rtctl.Scenario)
"""Records that are handed out whole for those who look inside; types of their own fields have no public name."""


class Annotated(NamedTuple):
    """An annotation as it stands in the source."""

    place: str
    written: Any
    module: types.ModuleType


def annotations_of(name: str, public: object) -> Iterator[Annotated]:
    """Annotations of a function, or of the public fields, properties and methods of a class."""
    if inspect.isfunction(public):
        plain = inspect.unwrap(public)
        for argument, written in plain.__annotations__.items():
            yield Annotated(f"{name}({argument})", written, sys.modules[plain.__module__])
    elif isinstance(public, type):
        for base in public.__mro__:
            if base.__module__.split(".")[0] in PACKAGES:
                yield from annotations_of_class(name, base)


def annotations_of_class(name: str, base: type) -> Iterator[Annotated]:
    module = sys.modules[base.__module__]
    for field, written in inspect.get_annotations(base).items():
        if not field.startswith("_"):
            yield Annotated(f"{name}.{field}", written, module)
    for member, value in base.__dict__.items():
        function = value.fget if isinstance(value, property) else getattr(value, "__func__", value)
        if not member.startswith("_") and inspect.isfunction(function):
            yield from annotations_of(f"{name}.{member}", function)


def names_of(module: types.ModuleType) -> dict[str, Any]:
    """What the names of a module mean, those that it imports for type checkers alone included."""
    known = dict(vars(module))
    for node in ast.walk(ast.parse(inspect.getsource(module))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in PACKAGES:
            source = importlib.import_module(str(node.module))
            known |= {
                one.asname or one.name: getattr(source, one.name)
                for one in node.names
                if hasattr(source, one.name)
            }
    return known


def our_types(written: Any, known: dict[str, Any]) -> Iterator[type]:
    """The program's own classes in an annotation."""
    if isinstance(written, ForwardRef):
        written = written.__forward_arg__
    if isinstance(written, str):
        for node in ast.walk(ast.parse(written, mode="eval")):
            if isinstance(node, ast.Name):
                yield from our_types(known.get(node.id), known) if node.id in known else ()
        return
    for inner in typing.get_args(written):
        if not isinstance(inner, str | list):
            yield from our_types(inner, known)
    if isinstance(written, type) and written.__module__.split(".")[0] in PACKAGES:
        yield written


@pytest.mark.parametrize("name", rtctl.__all__)
def test_every_type_of_a_public_name_is_public(name: str) -> None:
    public = getattr(rtctl, name)
    if public in INNER:
        return
    named = {id(getattr(rtctl, one)) for one in rtctl.__all__}
    missing = {
        f"{one.place}: {kind.__module__}.{kind.__qualname__}"
        for one in annotations_of(name, public)
        for kind in our_types(one.written, names_of(one.module))
        if id(kind) not in named
    }
    assert missing == set()


def test_the_walk_sees_what_type_checkers_see() -> None:
    """A property, a field of a named tuple, an argument, a field that only type checkers import."""
    seen = {
        kind
        for name in ("Diagnosis", "Finding", "run", "Comparison")
        for one in annotations_of(name, getattr(rtctl, name))
        for kind in our_types(one.written, names_of(one.module))
    }
    assert {rtctl.Gain, rtctl.DoubtCause, rtctl.Controller, rtctl.ComparedRecord, rtctl.Answer} <= seen


def test_the_reference_has_the_public_names() -> None:
    """Those of the package, and the one whose place there a subpackage takes."""
    written = REFERENCE.read_text(encoding="utf-8")
    assert "::: rtctl\n" in written
    hidden = [name for name in rtctl.__all__ if (Path(rtctl.__file__).parent / name).is_dir()]
    assert hidden == ["doubt"]
    assert f"::: {rtctl.doubt.__module__}.doubt\n" in written
