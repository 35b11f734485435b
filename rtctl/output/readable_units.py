"""Quantities in the unit in which a person reads them: SI prefixes that keep numbers between 1 and 1000.

Only the first factor of a unit takes a prefix, and only where it stands to the power one; a unit of several factors
keeps it while its number is handy, since people know mm/s^2 from their data. Hours, degrees, percents have no prefixes.
Reference: The International System of Units (BIPM, 9th edition), section 3.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

_PREFIXES = {"p": -12, "n": -9, "u": -6, "m": -3, "": 0, "k": 3, "M": 6, "G": 9}
_ALSO_READ = {"c": -2, "d": -1, "h": 2, "µ": -6, "μ": -6}
"""Prefixes that files have and that are not chosen."""
_SYMBOLS = ("ohm", "Hz", "Pa", "m", "V", "A", "N", "W", "J", "T", "s", "C", "F", "H")
_NO_MULTIPLES = ("s",)
"""Symbols of which people do not take thousands: a kilosecond is read by nobody."""
_UNIT = re.compile(rf"({'|'.join([*_PREFIXES, *_ALSO_READ])})({'|'.join(_SYMBOLS)})(?=$|[/*])")
_POWERS = str.maketrans("0123456789-.", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻·")


_HANDY = (0.01, 1e4)
"""Numbers that a unit of several factors keeps."""
_PLAIN, _PLAIN_WITH_ERROR = 1e4, 1e7
"""Sizes below which a number, and one beside its error, is written without a power of ten."""


class Scaled(NamedTuple):
    """A unit, and the factor by which numbers in the old one are multiplied."""

    factor: float
    unit: str

    def of(self, value: float) -> float:
        """Return a value of the old unit in the new one."""
        return self.factor * value

    def text(self, value: float, digits: int = 4) -> str:
        """Return a value of the old unit as `0.42 mm` in the new one."""
        plain = "" if self.unit in ("", "1", "dimensionless") else f" {self.unit}"
        return f"{_rounded(self.of(value), digits)}{plain}"


def _rounded(value: float, digits: int, plain: float = _PLAIN) -> str:
    """Return a number with so many digits: 190, not 1.9e+02; a large one with its power of ten."""
    text = f"{value:.{digits}g}"
    return f"{float(text):.12g}" if math.isfinite(value) and abs(value) < plain else text


def readable_unit(size: float, unit: str) -> Scaled:
    """Return the unit in which a quantity of `size` [`unit`] is a number from 1 to below 1000, and the factor to it.

    The unit itself where the size is 0 or not finite, or where it takes no SI prefix, or keeps the one that it has.
    """
    match = _UNIT.match(unit)
    if match is None or not (math.isfinite(size) and size != 0.0):
        return Scaled(1.0, unit)
    if len(match[0]) < len(unit) and _HANDY[0] <= abs(size) < _HANDY[1]:
        return Scaled(1.0, unit)
    given = (_PREFIXES | _ALSO_READ)[match[1]]
    # a size that prints as 1000 is one of the next unit
    wanted = 3 * math.floor((math.log10(abs(float(f"{size:.4g}"))) + given) / 3.0 + 1e-12)
    highest = 0 if match[2] in _NO_MULTIPLES else max(_PREFIXES.values())
    power = min(max(wanted, min(_PREFIXES.values())), max(highest, given))
    prefix = next((name for name, one in _PREFIXES.items() if one == power), match[1])
    return Scaled(10.0 ** (given - power), prefix + unit[len(match[1]) :])


def readable(value: float, unit: str, digits: int = 4) -> str:
    """Return `value` [`unit`] as a person writes it: 4.2e-4 mm as "420 nm", and what is infinite as "without bound"."""
    if math.isinf(value):
        return "without bound"
    return readable_unit(value, unit).text(value, digits)


def printed_unit(unit: str) -> str:
    """Return a unit as it is printed in pictures and pages: `mm/(s^2*V)` as `mm/(s²·V)`, um as µm, degC as °C."""
    text = re.sub(rf"\bu(?=({'|'.join(_SYMBOLS)}|g|K|rad)\b)", "µ", unit)
    text = re.sub(r"\b([pnmkMG]?|µ)ohm\b", r"\1Ω", text)
    text = re.sub(r"\bdeg(?=\b|[CF]\b)", "°", text)
    power = re.compile(r"(?:\^|\*\*)(?:\((-?[\d.]+)\)|(-?[\d.]+))")
    text = power.sub(lambda one: (one[1] or one[2]).translate(_POWERS), text)
    return text.replace("*", "·")


def significant(value: float, low: float, high: float) -> tuple[str, str, str]:
    """Return a value and the ends of its interval, with as many digits as the width of the interval supports."""
    width = abs(high - low)
    if not (width > 0.0 and width < float("inf")):
        return f"{value:.5g}", f"{low:.4g}", f"{high:.4g}"
    size = max(abs(value), width)
    digits = min(10, max(2, 2 + math.ceil(math.log10(size / width))))
    first, second, third = (_rounded(one, digits, _PLAIN_WITH_ERROR) for one in (value, low, high))
    return first, second, third


def with_standard_error(value: float, error: float, unit: str) -> str:
    """Return `26.00010 Hz, standard error 0.00021 Hz`, to two digits of the error; the value alone without one."""
    if not (error > 0.0 and math.isfinite(error)):
        return readable(value, unit)
    scaled = readable_unit(max(abs(value), error), unit)
    centre, wide = scaled.of(value), scaled.of(error)
    decimals = 1 - math.floor(math.log10(wide))
    if decimals >= 0 and abs(centre) < _PLAIN_WITH_ERROR:
        number = f"{centre:.{min(decimals, 12)}f}"
    else:
        number = f"{centre:.{max(1, decimals + math.floor(math.log10(max(abs(centre), wide))) + 1)}g}"
    plain = "" if scaled.unit in ("", "1", "dimensionless") else f" {scaled.unit}"
    return f"{number}{plain}, standard error {scaled.text(error, 2)}"
