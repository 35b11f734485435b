"""What a simulated plant tells and takes beside its wire: what it really does, and hidden effects that can be switched.

A plant that has it returns it by a method `inspection()`, before it is used; others are served without.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol


class Inspection(Protocol):
    """A look into a plant, past its instruments."""

    truths: Sequence[tuple[str, str]]
    """Names and units of what it really does."""
    switches: Mapping[str, str]
    """Units of the numbers that can be switched, by name."""

    def truth(self) -> tuple[float, ...]:
        """Return the values of `truths` now."""
        ...

    def values(self) -> Mapping[str, float]:
        """Return the values of `switches` now."""
        ...

    def check(self, name: str, value: float) -> None:
        """Do all that is slow about a change, such as compiling. Raises InputError where it is not possible."""
        ...

    def switch(self, name: str, value: float) -> None:
        """Give a number another value from now on; the plant's state stays. Only after `check`."""
        ...


class NoInspection:
    """Of a plant that has none, such as a user's own."""

    truths: Sequence[tuple[str, str]] = ()
    switches: Mapping[str, str] = {}

    def truth(self) -> tuple[float, ...]:
        """Return nothing."""
        return ()

    def values(self) -> Mapping[str, float]:
        """Return nothing."""
        return {}

    def check(self, name: str, value: float) -> None:
        """Take any: there is none to ask for."""

    def switch(self, name: str, value: float) -> None:
        """Do nothing."""


def inspection_of(plant: object) -> Inspection:
    """Return the inspection of a plant."""
    find = getattr(plant, "inspection", None)
    found: Inspection = NoInspection() if find is None else find()
    return found
