"""Which arguments a kernel changes in place: arrays whose entries it sets, and records whose fields it sets."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from rtctl.translation.source import Source, function_of, is_function, source_of

Handed = tuple[tuple[str, Callable[..., Any]], ...]
"""Functions that are handed to a function, by the names of its parameters."""


def mutated_parameters(source: Source, handed: Mapping[str, Callable[..., Any]]) -> frozenset[str]:
    """Return the names of the parameters that a function changes, or one that it calls or that is handed to it."""
    return _mutated(source.function, tuple(handed.items()))


@cache
def _mutated(function: Callable[..., Any], handed: Handed) -> frozenset[str]:
    source, given = source_of(function), dict(handed)
    roots = roots_of(source)
    changed: set[str] = set()
    for node in ast.walk(source.node):
        if isinstance(node, ast.Subscript | ast.Attribute) and isinstance(node.ctx, ast.Store):
            changed.add(_root(node, roots))
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            called = given.get(node.func.id, source.names.get(node.func.id))
            if callable(called) and not isinstance(called, type):
                callee = source_of(called)
                names = [argument.arg for argument in callee.node.args.args]
                inside = _mutated(callee.function, _handed_on(names, node.args, {**source.names, **given}))
                changed |= {
                    _root(argument, roots)
                    for name, argument in zip(names, node.args, strict=False)
                    if name in inside
                }
    return frozenset(changed - {""})


def _handed_on(names: list[str], arguments: list[ast.expr], known: Mapping[str, Any]) -> Handed:
    """Return the functions among the arguments of a call."""
    pairs = [
        (name, function_of(known.get(argument.id)))
        for name, argument in zip(names, arguments, strict=False)
        if isinstance(argument, ast.Name)
    ]
    return tuple((name, value) for name, value in pairs if is_function(value))


def roots_of(source: Source) -> dict[str, str]:
    """Return which parameter each name of a function stands for, or for a part of."""
    roots = {argument.arg: argument.arg for argument in source.node.args.args}
    _alias(source, roots)
    return roots


def _alias(source: Source, roots: dict[str, str]) -> None:
    """Note names that stand for a parameter or a part of it."""
    for node in ast.walk(source.node):
        if isinstance(node, ast.Assign):
            for target in node.targets:
                pairs = [(target, node.value)]
                if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                    pairs = list(zip(target.elts, node.value.elts, strict=False))
                for one, value in pairs:
                    if isinstance(one, ast.Name) and (root := _root(value, roots)):
                        roots.setdefault(one.id, root)


def _root(node: ast.AST, roots: dict[str, str]) -> str:
    while isinstance(node, ast.Subscript | ast.Attribute):
        node = node.value
    return roots.get(node.id, "") if isinstance(node, ast.Name) else ""
