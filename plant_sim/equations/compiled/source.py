"""Trees to the source of a kernel: one line a node, each node once; no text of the user is in it, only numbered names.

States are x0, x1, ..., inputs u0, ..., the time t [s], parameters p[k, j] of lane j; all SI. Both sides of `where`
are computed and one is taken, which the compiler turns into code for many lanes at once. The language of the source is
a `Dialect`: Python for kernels, C for plants that are exported (`plant_sim.equations.c_source`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from plant_sim.equations.language.evaluation import constant
from plant_sim.equations.language.functions import CONSTANTS, FUNCTIONS, TIME
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
)
from plant_sim.equations.system import State, System

MOST_FACTORS = 16
"""Largest exponent that is written as products."""


class Dialect(NamedTuple):
    """How a language writes what a tree is made of."""

    line: str
    parameter: str
    power: str
    choice: str
    either: str
    both: str
    negation: str
    unequal: str
    also: str
    """Between two conditions of which both must hold, when the second may go unread."""


PYTHON = Dialect(
    line="{variable} = {value}",
    parameter="p[{k}, j]",
    power="{base} ** {exponent}",
    choice="{one} if {condition} else {other}",
    either=" | ",
    both=" & ",
    negation="not {of}",
    unequal="!=",
    also="and",
)


def law_source(system: System, head: str, tail: str, *, limited: bool, dialect: Dialect = PYTHON) -> str:
    """Return the source of a function that computes the rates of all states.

    Args:
        system: The equations.
        head: Its first lines, which define the variables.
        tail: Its last line, with `{rates}` in the place of the rates.
        limited: Whether a rate is 0 where its state is at a limit that it points beyond.
        dialect: Its language.
    """
    writer = _Writer(system, tuple(one.rate for one in system.states), dialect)
    rates = [writer.number(one.rate) for one in system.states]
    if limited:
        rates = [
            writer.limited(rate, f"x{k}", one.low, one.high)
            for k, (rate, one) in enumerate(zip(rates, system.states, strict=True))
        ]
    return f"{head}{writer.body()}    {tail.format(rates=', '.join(rates))}\n"


def numbers_source(
    system: System, trees: tuple[Tree, ...], head: str, tail: str, dialect: Dialect = PYTHON
) -> str:
    """Return the source of a function that computes some trees, with `{numbers}` in their place in `tail`."""
    writer = _Writer(system, trees, dialect)
    numbers = [writer.number(tree) for tree in trees]
    return f"{head}{writer.body()}    {tail.format(numbers=', '.join(numbers))}\n"


def loaded(system: System, arguments: str) -> str:
    """Return the head of a function of arrays `x` (states,) and `u` (inputs,), with its variables defined."""
    states = "".join(f"    x{k} = x[{k}]\n" for k in range(len(system.states)))
    inputs = "".join(f"    u{k} = u[{k}]\n" for k in range(len(system.inputs)))
    return f"def {arguments}:\n{states}{inputs}"


def kept(state: State, value: str) -> str:
    """Return the source of a value of a state, put back where it is beyond a limit; NaN stays."""
    if state.low > -math.inf:
        value = f"({state.low!r} if {value} < {state.low!r} else {value})"
    if state.high < math.inf:
        value = f"({state.high!r} if {value} > {state.high!r} else {value})"
    return value


class _Writer:
    """The lines so far, and the variable of each node that was written."""

    def __init__(self, system: System, trees: tuple[Tree, ...], dialect: Dialect) -> None:
        self.lines: list[str] = []
        self._dialect = dialect
        self._known: dict[Tree, str] = {}
        self._called: dict[tuple[str, tuple[Tree, ...]], list[str]] = {}
        terms = system.needed_terms(trees)
        used = {name for tree in (*trees, *terms.values()) for name in names_in(tree)}
        self._variables: dict[str, str] = {
            TIME: "t",
            **{name: repr(value) for name, value in CONSTANTS.items()},
        }
        self._variables |= {one.name: f"x{k}" for k, one in enumerate(system.states)}
        self._variables |= {one.name: f"u{k}" for k, one in enumerate(system.inputs)}
        for k, parameter in enumerate(system.parameters):
            if parameter.name in used:
                self.lines.append(dialect.line.format(variable=f"p{k}", value=dialect.parameter.format(k=k)))
                self._variables[parameter.name] = f"p{k}"
        for name, tree in terms.items():
            self._variables[name] = self.number(tree)

    def body(self) -> str:
        """Return the lines of the function."""
        return "".join(f"    {line}\n" for line in self.lines)

    def _new(self, value: str) -> str:
        variable = f"c{len(self.lines)}"
        self.lines.append(self._dialect.line.format(variable=variable, value=value))
        return variable

    def _chosen(self, condition: str, one: str, other: str) -> str:
        return self._dialect.choice.format(condition=condition, one=one, other=other)

    def limited(self, rate: str, state: str, low: float, high: float) -> str:
        """Return the rate, 0 where the state is at a limit that it points beyond."""
        if low > -math.inf:
            outward = f"{state} <= {low!r} {self._dialect.also} {rate} < 0.0"
            rate = self._new(self._chosen(outward, "0.0", rate))
        if high < math.inf:
            outward = f"{state} >= {high!r} {self._dialect.also} {rate} > 0.0"
            rate = self._new(self._chosen(outward, "0.0", rate))
        return rate

    def number(self, tree: Tree) -> str:
        """Return the variable or literal of a tree, written once however often it stands there."""
        if isinstance(tree, Number):
            return _literal(tree.value)
        if isinstance(tree, Name):
            return self._variables[tree.name]
        if tree not in self._known:
            self._known[tree] = self._new(self._value(tree))
        return self._known[tree]

    def _value(self, tree: Tree) -> str:
        match tree:
            case Negative(of):
                return f"-{self.number(of)}"
            case Operation("^", base, exponent):
                return self._power(base, exponent)
            case Comparison("!=", left, right):
                return f"{self.number(left)} {self._dialect.unequal} {self.number(right)}"
            case Operation(operator, left, right) | Comparison(operator, left, right):
                return f"{self.number(left)} {operator} {self.number(right)}"
            case Logic("not", (one,)):
                return self._dialect.negation.format(of=self.number(one))
            case Logic(word, conditions):
                between = self._dialect.both if word == "and" else self._dialect.either
                return between.join(self.number(one) for one in conditions)
            case Own():
                return self._own(tree)
            case Call(function, arguments):
                return self._call(function, [self.number(one) for one in arguments])
            case _:
                raise TypeError(f"{tree!r} is no node")

    def _own(self, tree: Own) -> str:
        """Return a number of a function of the user, which is called once for all that it returns."""
        block = tree.block
        if block is None:
            raise TypeError(f"{tree!r} is not bound to a class")
        key = (block.symbol, tree.arguments)
        if key not in self._called:
            given = [
                _scaled(self.number(one), 1.0 / factor)
                for one, factor in zip(tree.arguments, block.argument_factors, strict=True)
            ]
            made = [f"o{len(self._called)}_{k}" for k in range(len(block.members))]
            self.lines.append(f"{', '.join(made)}, = {block.symbol}({', '.join(given)})")
            self._called[key] = made
        place = block.members.index(tree.member)
        return _scaled(self._called[key][place], block.member_factors[place])

    def _power(self, base: Tree, exponent: Tree) -> str:
        under, power = self.number(base), constant(exponent)
        if power == 0.5:
            return f"sqrt({under})"
        if power is None or power != int(power) or not 1 <= abs(power) <= MOST_FACTORS:
            return self._dialect.power.format(base=under, exponent=self.number(exponent))
        square, made = under, ""
        bits = f"{int(abs(power)):b}"
        for bit_place, bit in zip(range(len(bits) - 1, -1, -1), reversed(bits), strict=True):
            if bit == "1":
                made = self._new(f"{made} * {square}") if made else square
            if bit_place:
                square = self._new(f"{square} * {square}")
        return f"1.0 / {made}" if power < 0 else made

    def _call(self, function: str, arguments: Sequence[str]) -> str:
        if function == "where":
            condition, one, other = arguments
            return self._chosen(condition, one, other)
        if function == "sign":
            (of,) = arguments
            return self._chosen(
                f"{of} > 0.0", "1.0", f"({self._chosen(f'{of} < 0.0', '-1.0', f'0.0 * {of}')})"
            )
        if function in ("min", "max"):
            found, sign = arguments[0], "<" if function == "min" else ">"
            for other in arguments[1:]:
                beyond = self._dialect.negation.format(of=f"({found} {sign}= {other})")
                found = self._new(self._chosen(beyond, other, found))
            return found
        return f"{FUNCTIONS[function].code}({', '.join(arguments)})"


def _scaled(value: str, factor: float) -> str:
    return value if factor == 1.0 else f"{value} * {factor!r}"


def _literal(value: float) -> str:
    return repr(float(value)) if value >= 0.0 else f"({float(value)!r})"
