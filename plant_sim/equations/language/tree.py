"""Nodes of an expression, and what is asked of every tree: its names, its text."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from plant_sim.equations.language.block import Block


@dataclass(frozen=True, slots=True)
class Number:
    """A plain number."""

    value: float


@dataclass(frozen=True, slots=True)
class Name:
    """An input, a state, a parameter, a term, a constant or the time."""

    name: str


@dataclass(frozen=True, slots=True)
class Negative:
    """-of."""

    of: Tree


@dataclass(frozen=True, slots=True)
class Operation:
    """`left operator right`, the operator one of + - * / ^."""

    operator: str
    left: Tree
    right: Tree


@dataclass(frozen=True, slots=True)
class Call:
    """A function of the language and its arguments."""

    function: str
    arguments: tuple[Tree, ...]


@dataclass(frozen=True, slots=True)
class Comparison:
    """`left operator right`, the operator one of < <= > >= == !=; a condition."""

    operator: str
    left: Tree
    right: Tree


@dataclass(frozen=True, slots=True)
class Logic:
    """Conditions joined by "and", "or"; "not" has one."""

    word: str
    conditions: tuple[Tree, ...]


@dataclass(frozen=True, slots=True)
class Own:
    """`function.member(arguments)`: a number that a compiled function of the user's class returns, of several."""

    function: str
    member: str
    arguments: tuple[Tree, ...]
    block: Block | None = None
    """The function itself; None in a text that was not bound to a class yet."""


Tree: TypeAlias = Number | Name | Negative | Operation | Call | Comparison | Logic | Own
STRENGTH = {"or": 1, "and": 2, "not": 3, "compare": 4, "+": 5, "-": 5, "*": 6, "/": 6, "negative": 7, "^": 8}
"""How tightly operators hold; what is not listed holds most."""
_ATOM = 9


def is_condition(tree: Tree) -> bool:
    """Return whether `tree` is true or false, not a number."""
    return isinstance(tree, Comparison | Logic)


def children(tree: Tree) -> tuple[Tree, ...]:
    """Return the trees right below `tree`."""
    match tree:
        case Operation() | Comparison():
            return (tree.left, tree.right)
        case Call() | Own():
            return tree.arguments
        case Logic():
            return tree.conditions
        case Negative():
            return (tree.of,)
        case _:
            return ()


def nodes(tree: Tree) -> Iterator[Tree]:
    """Return all nodes of `tree`."""
    yield tree
    for child in children(tree):
        yield from nodes(child)


def names_in(tree: Tree) -> Iterator[str]:
    """Return the names in `tree`, in the order of its text; one that stands there twice comes twice."""
    if isinstance(tree, Name):
        yield tree.name
    for child in children(tree):
        yield from names_in(child)


def written(tree: Tree) -> str:
    """Return `tree` as a person writes it, with as few brackets as it needs."""
    return _written(tree, 0)


def _written(tree: Tree, around: int) -> str:
    match tree:
        case Number():
            return f"{tree.value:.15g}"
        case Name():
            return tree.name
        case Own(function, member, arguments):
            return f"{function}.{member}({', '.join(written(one) for one in arguments)})"
        case Call():
            return f"{tree.function}({', '.join(written(one) for one in tree.arguments)})"
        case Negative():
            own, text = STRENGTH["negative"], f"-{_written(tree.of, STRENGTH['negative'])}"
        case Operation(operator, left, right):
            own = STRENGTH[operator]
            after = own if operator in "^" else own + 1
            before = own + 1 if operator == "^" else own
            between = f" {operator} " if operator in "+-" else operator
            text = f"{_written(left, before)}{between}{_written(right, after)}"
        case Comparison(operator, left, right):
            own = STRENGTH["compare"]
            text = f"{_written(left, own + 1)} {operator} {_written(right, own + 1)}"
        case Logic("not", (one,)):
            own, text = STRENGTH["not"], f"not {_written(one, STRENGTH['not'])}"
        case Logic(word, conditions):
            own = STRENGTH[word]
            text = f" {word} ".join(_written(one, own + 1) for one in conditions)
    return f"({text})" if own < around else text


def terms_of(tree: Tree) -> Iterator[Tree]:
    """Return the terms of a sum, a single one of anything else; signs are left out."""
    if isinstance(tree, Operation) and tree.operator in "+-":
        yield from terms_of(tree.left)
        yield from terms_of(tree.right)
    elif isinstance(tree, Negative):
        yield from terms_of(tree.of)
    else:
        yield tree


def substituted(tree: Tree, by: Mapping[str, Tree]) -> Tree:
    """Return `tree` with other trees in the places of names."""
    if not by:
        return tree
    return rebuilt(tree, lambda one: by.get(one.name, one) if isinstance(one, Name) else one)


def rebuilt(tree: Tree, change: Callable[[Tree], Tree]) -> Tree:
    """Return `tree` with each node changed, those below it first."""
    match tree:
        case Negative(of):
            made: Tree = Negative(rebuilt(of, change))
        case Operation(operator, left, right):
            made = Operation(operator, rebuilt(left, change), rebuilt(right, change))
        case Comparison(operator, left, right):
            made = Comparison(operator, rebuilt(left, change), rebuilt(right, change))
        case Call(function, arguments):
            made = Call(function, tuple(rebuilt(one, change) for one in arguments))
        case Logic(word, conditions):
            made = Logic(word, tuple(rebuilt(one, change) for one in conditions))
        case Own(function, member, arguments, block):
            made = Own(function, member, tuple(rebuilt(one, change) for one in arguments), block)
        case _:
            made = tree
    return change(made)
