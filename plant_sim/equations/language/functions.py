"""Functions of the language: number of arguments, what they ask of the units, and how a compiled kernel writes them."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple


class Asks(StrEnum):
    """What a function asks of the units of its arguments, and which unit its value has."""

    NUMBER = "plain numbers in, a plain number out"
    SAME = "all arguments in one unit, which the value has"
    ROOT = "the value has the root of the unit"
    SIGN = "any unit in, a plain number out"
    RATIO = "both arguments in one unit, a plain number out"
    CHOICE = "a condition, then two values of one unit"


class Function(NamedTuple):
    """A function of the language."""

    least: int
    """Least number of arguments."""
    most: int
    asks: Asks
    code: str
    """Name of it in a kernel; "" where the writer of kernels has its own form."""


MOST_ARGUMENTS = 16
_PLAIN = {
    name: name for name in ("exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")
}
FUNCTIONS: dict[str, Function] = {
    **{name: Function(1, 1, Asks.NUMBER, code) for name, code in _PLAIN.items()},
    "atan2": Function(2, 2, Asks.RATIO, "atan2"),
    "sqrt": Function(1, 1, Asks.ROOT, "sqrt"),
    "abs": Function(1, 1, Asks.SAME, "fabs"),
    "floor": Function(1, 1, Asks.NUMBER, "floor"),
    "sign": Function(1, 1, Asks.SIGN, ""),
    "min": Function(2, MOST_ARGUMENTS, Asks.SAME, "min"),
    "max": Function(2, MOST_ARGUMENTS, Asks.SAME, "max"),
    "where": Function(3, 3, Asks.CHOICE, ""),
}
CONSTANTS = {"pi": 3.141592653589793}
TIME = "t"
"""Name of the time since a record's first sample [s]."""
WORDS = ("and", "or", "not")
RESERVED = frozenset((*FUNCTIONS, *CONSTANTS, TIME, *WORDS))
"""Names that no input, state, parameter or term may have."""
