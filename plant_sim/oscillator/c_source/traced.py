"""Numbers that remember how they were computed from parameters, so that a plant can compute them anew in C."""

from __future__ import annotations

from typing import Any


class Traced(float):
    """A number and the C expression of it."""

    text: str

    def __new__(cls, value: float, text: str) -> Traced:
        """Return `value`, which is `text` in C."""
        made = super().__new__(cls, value)
        made.text = text
        return made

    def __add__(self, other: Any) -> Traced:
        return _made(float.__add__(self, other), self, "+", other)

    def __radd__(self, other: Any) -> Traced:
        return _made(float.__radd__(self, other), other, "+", self)

    def __sub__(self, other: Any) -> Traced:
        return _made(float.__sub__(self, other), self, "-", other)

    def __rsub__(self, other: Any) -> Traced:
        return _made(float.__rsub__(self, other), other, "-", self)

    def __mul__(self, other: Any) -> Traced:
        return _made(float.__mul__(self, other), self, "*", other)

    def __rmul__(self, other: Any) -> Traced:
        return _made(float.__rmul__(self, other), other, "*", self)

    def __truediv__(self, other: Any) -> Traced:
        return _made(float.__truediv__(self, other), self, "/", other)

    def __rtruediv__(self, other: Any) -> Traced:
        return _made(float.__rtruediv__(self, other), other, "/", self)

    def __neg__(self) -> Traced:
        return Traced(float.__neg__(self), f"(-{self.text})")


def c_text(value: float) -> str:
    """Return a number in C: its expression where it is traced, else its digits."""
    if isinstance(value, Traced):
        return value.text
    return repr(float(value)) if value >= 0.0 else f"({float(value)!r})"


def _made(value: float, left: float, operator: str, right: float) -> Traced:
    return Traced(value, f"({c_text(left)} {operator} {c_text(right)})")
