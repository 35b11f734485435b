"""Text to a tree, by recursive descent over a grammar of its own; nothing else is understood.

    condition  := both {"or" both}                   only inside where(...) and brackets
    both       := denied {"and" denied}
    denied     := "not" denied | compared
    compared   := sum [("<" | "<=" | ">" | ">=" | "==" | "!=") sum]
    sum        := product {("+" | "-") product}
    product    := signed {("*" | "/") signed}
    signed     := ("+" | "-") signed | power
    power      := atom [("^" | "**") signed]
    atom       := number | name | call | name "." call | "(" condition ")"
    call       := name "(" condition {"," condition} ")"

Length, number of nodes and depth are limited, so that no text takes long or much memory.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple, NoReturn

from plant_sim.equations.language.functions import FUNCTIONS, WORDS
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
    is_condition,
)
from rtctl.border.errors import nearest

LONGEST = 4000
"""Characters of an expression."""
MOST_NODES = 500
DEEPEST = 40
"""Levels of brackets, signs and powers inside each other."""
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[^\W\d]\w*)"
    r"|(?P<sign>\*\*|<=|>=|==|!=|[-+*/^()<>,.]))"
)
_COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")
NAME = re.compile(r"[^\W\d_]\w*\Z")
"""A name: letters, digits and underscores, a letter first."""


class _Token(NamedTuple):
    kind: str
    text: str
    at: int


def parse(text: str) -> Tree:
    """Return the tree of an expression. Raises ValueError in words for what is not in the grammar."""
    if len(text) > LONGEST:
        raise ValueError(f"{len(text)} characters are too long, at most {LONGEST}; divide it by model.terms")
    reading = _Reading(_tokens(text))
    tree = reading.condition()
    reading.expect_end()
    if is_condition(tree):
        raise ValueError(
            "it is a condition, a number is needed; a condition stands in where(condition, a, b), and an event has the "
            'difference, such as when = "x - limit" with direction = "rising"'
        )
    return tree


def _tokens(text: str) -> list[_Token]:
    found, at, end = [], 0, len(text.rstrip())
    while at < end:
        match = _TOKEN.match(text, at)
        if match is None or match.lastgroup is None:
            start = at + len(text[at:]) - len(text[at:].lstrip())
            hint = "; write == to compare" if text[start] == "=" else ""
            raise ValueError(f"{text[start]!r} at character {start + 1} is not understood{hint}")
        found.append(_Token(match.lastgroup, match[match.lastgroup], match.start(match.lastgroup)))
        at = match.end()
    return [*found, _Token("end", "", end)]


class _Reading:
    """The tokens, the place, and how much was made of them."""

    def __init__(self, tokens: list[_Token]) -> None:
        self._tokens, self._place, self._nodes, self._depth = tokens, 0, 0, 0

    @property
    def _next(self) -> _Token:
        return self._tokens[self._place]

    def _take(self, *texts: str) -> str:
        """Take the next token if it is one of `texts`; "" otherwise."""
        if self._next.kind in ("sign", "name") and self._next.text in texts:
            self._place += 1
            return self._tokens[self._place - 1].text
        return ""

    def _fail(self, expected: str) -> NoReturn:
        token = self._next
        if token.kind == "end":
            raise ValueError(f"it ends where {expected} is needed" if token.at else "it is empty")
        raise ValueError(f"{token.text!r} at character {token.at + 1}: {expected} is needed here")

    def expect_end(self) -> None:
        """Raise ValueError where something follows the expression."""
        if self._next.kind != "end":
            self._fail("an operator or the end")

    def _made(self, tree: Tree) -> Tree:
        self._nodes += 1
        if self._nodes > MOST_NODES:
            raise ValueError(f"it has more than {MOST_NODES} parts; divide it by model.terms")
        return tree

    def _deeper(self, by: int) -> None:
        self._depth += by
        if self._depth > DEEPEST:
            raise ValueError(f"brackets, signs and powers are nested more than {DEEPEST} deep")

    def condition(self) -> Tree:
        """Read a condition, or a number where none is compared."""
        return self._joined("or", lambda: self._joined("and", self._denied))

    def _joined(self, word: str, read: Callable[[], Tree]) -> Tree:
        parts = [read()]
        while self._take(word):
            parts.append(read())
        if len(parts) == 1:
            return parts[0]
        for part in parts:
            if not is_condition(part):
                raise ValueError(f'"{word}" joins conditions such as x > 0, not numbers')
        return self._made(Logic(word, tuple(parts)))

    def _denied(self) -> Tree:
        if not self._take("not"):
            return self._compared()
        self._deeper(1)
        denied = self._denied()
        self._deeper(-1)
        if not is_condition(denied):
            raise ValueError('"not" denies a condition such as x > 0, not a number')
        return self._made(Logic("not", (denied,)))

    def _compared(self) -> Tree:
        left = self._sum()
        operator = self._take(*_COMPARISONS)
        if not operator:
            return left
        right = self._sum()
        if self._next.text in _COMPARISONS:
            raise ValueError("two comparisons in a row; write a < b and b < c")
        return self._made(Comparison(operator, _number(left), _number(right)))

    def _sum(self) -> Tree:
        found = self._product()
        while operator := self._take("+", "-"):
            found = self._made(Operation(operator, _number(found), _number(self._product())))
        return found

    def _product(self) -> Tree:
        found = self._signed()
        while operator := self._take("*", "/"):
            found = self._made(Operation(operator, _number(found), _number(self._signed())))
        return found

    def _signed(self) -> Tree:
        sign = self._take("+", "-")
        if not sign:
            return self._power()
        self._deeper(1)
        of = _number(self._signed())
        self._deeper(-1)
        return self._made(Negative(of)) if sign == "-" else of

    def _power(self) -> Tree:
        base = self._atom()
        if not self._take("^", "**"):
            return base
        self._deeper(1)
        exponent = _number(self._signed())
        self._deeper(-1)
        return self._made(Operation("^", _number(base), exponent))

    def _atom(self) -> Tree:
        token = self._next
        if token.kind == "number":
            self._place += 1
            value = float(token.text)
            if value == float("inf"):
                raise ValueError(f"{token.text} is too large")
            return self._made(Number(value))
        if token.kind == "name" and token.text not in WORDS:
            self._place += 1
            if self._next.text == ".":
                return self._own(token.text)
            return self._call(token.text) if self._next.text == "(" else self._made(Name(token.text))
        if self._take("("):
            self._deeper(1)
            inside = self.condition()
            self._deeper(-1)
            if not self._take(")"):
                self._fail("a closing bracket")
            return inside
        return self._fail("a number, a name or a bracket")

    def _call(self, name: str) -> Tree:
        if name not in FUNCTIONS:
            raise ValueError(f'"{name}" is no function{nearest(name, FUNCTIONS)}')
        return self._made(Call(name, _checked(name, self._arguments())))

    def _own(self, function: str) -> Tree:
        """Read the rest of a call of a function of the user's class."""
        member, bracket = (
            self._tokens[self._place + 1 :][:2] if len(self._tokens) > self._place + 2 else 2 * [self._next]
        )
        if member.kind != "name" or bracket.text != "(":
            self._fail("an operator, or a call of a class such as rates.x(x, u),")
        self._place += 2
        arguments = tuple(_number(one) for one in self._arguments())
        return self._made(Own(function, member.text, arguments))

    def _arguments(self) -> list[Tree]:
        """Read "(", conditions or numbers, ")"."""
        self._take("(")
        self._deeper(1)
        arguments = [] if self._next.text == ")" else [self.condition()]
        while self._take(","):
            arguments.append(self.condition())
        self._deeper(-1)
        if not self._take(")"):
            self._fail("a comma or a closing bracket")
        return arguments


def _checked(name: str, arguments: list[Tree]) -> tuple[Tree, ...]:
    """Return the arguments of a function. Raises ValueError where their number or kind is wrong."""
    function = FUNCTIONS[name]
    if not function.least <= len(arguments) <= function.most:
        wanted = str(function.least) if function.least == function.most else f"{function.least} or more"
        raise ValueError(f"{name} takes {wanted} arguments, got {len(arguments)}")
    if name == "where" and not is_condition(arguments[0]):
        raise ValueError("where takes a condition first, such as where(x > 0, a, b)")
    for argument in arguments[1:] if name == "where" else arguments:
        _number(argument)
    return tuple(arguments)


def _number(tree: Tree) -> Tree:
    """Return `tree`. Raises ValueError where it is a condition."""
    if is_condition(tree):
        raise ValueError("a condition is no number; it stands in where(condition, a, b)")
    return tree
