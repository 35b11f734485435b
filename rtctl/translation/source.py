"""Source of a kernel: its syntax tree, its comments, and what the names in it stand for."""

from __future__ import annotations

import ast
import inspect
import io
import textwrap
import tokenize
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from types import FunctionType
from typing import Any

from rtctl.border.errors import RtctlError


class NotTranslatableError(RtctlError):
    """A kernel uses something that the translated language does not have; says where."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """A function as it is written."""

    function: Callable[..., Any]
    node: ast.FunctionDef
    names: Mapping[str, Any]
    """What its free names stand for."""
    comments: Mapping[int, str]
    """Comments by line of `node`."""

    @property
    def module(self) -> str:
        """Module that defines it."""
        return self.function.__module__

    def error(self, node: ast.AST, what: str) -> NotTranslatableError:
        """Return the error for a part of it."""
        line = self.function.__code__.co_firstlineno + getattr(node, "lineno", 1) - 1
        return NotTranslatableError(f"{self.module}, line {line}, {self.function.__name__}: {what}")


def source_of(function: Callable[..., Any]) -> Source:
    """Return the source of a function or of a compiled kernel. Raises NotTranslatableError."""
    return _read(function_of(function))


def function_of(value: Any) -> Any:
    """Return the function of a compiled kernel; anything else as it is."""
    return getattr(value, "py_func", value)


def is_function(value: Any) -> bool:
    """Return whether a value is a function or a compiled kernel, which can be handed to another one."""
    return isinstance(function_of(value), FunctionType)


@cache
def _read(function: Callable[..., Any]) -> Source:
    try:
        text = textwrap.dedent(inspect.getsource(function))
    except (OSError, TypeError) as error:
        raise NotTranslatableError(f"{function!r}: its source cannot be read: {error}") from None
    node = ast.parse(text).body[0]
    if not isinstance(node, ast.FunctionDef):
        raise NotTranslatableError(f"{function!r}: not a function with a name")
    names = dict(inspect.getclosurevars(function).globals)
    names |= {
        name: value for name, value in function.__globals__.items() if isinstance(value, bool | int | float)
    }
    names |= inspect.getclosurevars(function).nonlocals
    source = Source(function=function, node=node, names=names, comments=_comments(text))
    _Decided(names).visit(node)
    return source


def _comments(text: str) -> dict[int, str]:
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    found = {token.start[0]: token.string.lstrip("# ") for token in tokens if token.type == tokenize.COMMENT}
    return {line: text for line, text in found.items() if not text.startswith(("noqa", "fmt:", "type:"))}


class _Decided(ast.NodeTransformer):
    """Keeps of a branch on a constant only what is reached."""

    def __init__(self, names: Mapping[str, Any]) -> None:
        self._names = names

    def visit_If(self, node: ast.If) -> Any:
        self.generic_visit(node)
        decided = self._decided(node.test)
        if decided is None:
            return node
        return node.body if decided else node.orelse or ast.Pass()

    def visit_IfExp(self, node: ast.IfExp) -> Any:
        self.generic_visit(node)
        decided = self._decided(node.test)
        return node if decided is None else node.body if decided else node.orelse

    def _decided(self, test: ast.expr) -> bool | None:
        value = self._names.get(test.id) if isinstance(test, ast.Name) else None
        return value if isinstance(value, bool) else None
