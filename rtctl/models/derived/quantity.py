"""Quantities that follow from a model's parameters, in the terms of those who use the device.

A function of estimated parameters is estimated with them: q = f(p), and its 95 % interval has the half width
sqrt(sum (df/dp_i h_i)^2) of their half widths h_i, as if the parameters were independent.
Reference: JCGM 100:2008 (GUM), section 5.1.2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

from rtctl.output.readable_units import readable_unit, significant

STEP = 1e-6
"""Relative step of the finite differences."""


class Estimated(Protocol):
    """A parameter with its 95 % interval."""

    @property
    def value(self) -> float:
        """Value in `unit`."""
        ...

    @property
    def low(self) -> float:
        """Lower end of the interval."""
        ...

    @property
    def high(self) -> float:
        """Upper end of the interval."""
        ...

    @property
    def unit(self) -> str:
        """Unit, "1" where there is none."""
        ...


class Derived(NamedTuple):
    """A derived quantity with its 95 % interval, in `unit`."""

    name: str
    value: float
    low: float
    high: float
    unit: str

    def as_json(self) -> dict[str, Any]:
        """Return the entry of `derived` in `diagnosis.json` and in what `identify --json` prints."""
        return self._asdict()

    def in_words(self) -> tuple[str, str]:
        """Return its name and `1.8 ms, 95 % 1.7 to 1.9`, as many digits as the interval supports."""
        shown = self.in_readable_unit()
        unit = "" if shown.unit in ("", "1") else f" {shown.unit}"
        if not shown.high > shown.low:
            return self.name, f"{shown.value:.4g}{unit}"
        value, low, high = significant(shown.value, shown.low, shown.high)
        return self.name, f"{value}{unit}, 95 % {low} to {high}"

    def in_readable_unit(self) -> Derived:
        """Return the quantity in the unit that fits its size."""
        wide = 0.5 * (self.high - self.low)
        scaled = readable_unit(max(abs(self.value), wide) if wide > 0.0 else self.value, self.unit)
        value, low, high = (scaled.of(one) for one in (self.value, self.low, self.high))
        return Derived(self.name, value, low, high, scaled.unit)


def derive(name: str, unit: str, of: Callable[..., float], *parameters: Estimated | None) -> list[Derived]:
    """Return the quantity `of(*values)` [`unit`]; none where a parameter is missing or it is not a finite number."""
    known = [one for one in parameters if one is not None]
    if len(known) < len(parameters):
        return []
    values = [one.value for one in known]
    try:
        value = of(*values)
        half = math.hypot(*(_change(of, values, k, one) for k, one in enumerate(known)))
    except (ArithmeticError, ValueError):
        return []
    if not math.isfinite(value):
        return []
    return [Derived(name, value, value - half, value + half, unit)]


def _change(of: Callable[..., float], values: Sequence[float], k: int, parameter: Estimated) -> float:
    """Return the half width that parameter `k` gives to the quantity."""
    half = 0.5 * (parameter.high - parameter.low)
    if not half > 0.0:
        return 0.0
    step = STEP * (abs(values[k]) or half)
    above, below = ([*values[:k], values[k] + sign * step, *values[k + 1 :]] for sign in (1.0, -1.0))
    return half * (of(*above) - of(*below)) / (2.0 * step)
