"""Numbers of a tree by NumPy, node by node: slow and simple, for checks and for the slopes that set the step."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import reduce
from typing import Any

import numpy as np

from plant_sim.equations.language.functions import CONSTANTS
from plant_sim.equations.language.tree import (
    Call,
    Comparison,
    Logic,
    Name,
    Negative,
    Number,
    Operation,
    Own,
    Tree,
    names_in,
    nodes,
)

_OPERATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide, "^": np.power,
    "<": np.less, "<=": np.less_equal, ">": np.greater, ">=": np.greater_equal, "==": np.equal, "!=": np.not_equal,
    "and": np.logical_and, "or": np.logical_or,
}  # fmt: skip
_CALLS: dict[str, Callable[..., Any]] = {
    **{name: getattr(np, name) for name in ("exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh", "sqrt")},
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "atan2": np.arctan2, "abs": np.abs, "floor": np.floor,
    "sign": np.sign, "where": np.where,
    "min": lambda *values: reduce(np.minimum, values), "max": lambda *values: reduce(np.maximum, values),
}  # fmt: skip


def evaluate(tree: Tree, values: Mapping[str, Any]) -> Any:
    """Return the number or array of a tree; what has no value is NaN or infinite, as in a compiled kernel.

    Args:
        tree: The expression.
        values: Number or array of each name; those in one expression broadcast.
    """
    with np.errstate(all="ignore"):
        return _evaluated(tree, values)


def _evaluated(tree: Tree, values: Mapping[str, Any]) -> Any:
    match tree:
        case Number(value):
            return np.float64(value)
        case Name(name):
            return values[name] if name in values else np.float64(CONSTANTS[name])
        case Negative(of):
            return -_evaluated(of, values)
        case Operation(operator, left, right) | Comparison(operator, left, right):
            return _OPERATIONS[operator](_evaluated(left, values), _evaluated(right, values))
        case Logic("not", (one,)):
            return np.logical_not(_evaluated(one, values))
        case Logic(word, conditions):
            return reduce(_OPERATIONS[word], [_evaluated(one, values) for one in conditions])
        case Own(_, member, arguments, block):
            assert block is not None  # trees are bound to their class before anything is computed
            return block.value(member, [_evaluated(one, values) for one in arguments])
        case Call(function, arguments):
            return _CALLS[function](*(_evaluated(one, values) for one in arguments))


def constant(tree: Tree) -> float | None:
    """Return the value of a tree of numbers alone; None where it has names."""
    if set(names_in(tree)) - CONSTANTS.keys() or any(isinstance(one, Own) for one in nodes(tree)):
        return None
    return float(evaluate(tree, {}))
