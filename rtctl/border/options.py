"""Checks of options where they are made: one InputError that names the option, its unit and its limits."""

from __future__ import annotations

import math
import numbers
from typing import Any

from rtctl.border.errors import InputError

LARGEST_SEED = 2**63 - 1
"""Largest seed of a random generator."""


def check_integer(name: str, value: Any, low: int, high: int, meaning: str = "") -> int:
    """Return `value` as an integer between `low` and `high`, both included.

    Args:
        name: The option, as the user wrote it.
        value: What was given; NumPy integers are accepted, truth values are not.
        low: Least value that is allowed.
        high: Largest value that is allowed.
        meaning: What is counted, such as "play operators"; it stands behind the limits in the message.

    Raises:
        InputError: The value is no integer or outside the limits.
    """
    words = f" {meaning}" if meaning else ""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise InputError(f"{name} must be an integer from {low} to {high}{words}, got {value!r}")
    number = int(value)
    if not low <= number <= high:
        raise InputError(f"{name} {number}: {low} to {high}{words}")
    return number


def check_number(
    name: str, value: Any, limits: str, *, low: float = -math.inf, high: float = math.inf
) -> float:
    """Return `value` as a float from `low` to `high`; NaN is refused.

    Args:
        name: The option, as the user wrote it.
        value: What was given.
        limits: The limits in words with unit and an example; the end of the message.
        low: Least value that is allowed.
        high: Largest value that is allowed.

    Raises:
        InputError: The value is no real number or outside the limits.
    """
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise InputError(f"{name} must be a number, got {value!r}: it {limits}")
    number = float(value)
    if not low <= number <= high:
        raise InputError(f"{name} {number:g} {limits}")
    return number
