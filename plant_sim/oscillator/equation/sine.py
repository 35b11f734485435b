"""A sine that the compiler works on for eight lanes at a time, which it does not with that of the C library.

x is within a quarter turn of k pi, where a Taylor series of ten terms is off by (pi / 2)^21 / 21! = 3e-16.
"""

from __future__ import annotations

import math
from typing import Any

from plant_sim.oscillator.equation.binding import law

_PI_HIGH = float.fromhex("0x1.921fb54400000p+1")
_PI_LOW = math.pi - _PI_HIGH + 1.2246467991473532e-16
"""pi in two parts, so that k pi is subtracted with its last digits: the first has zeros where k needs room."""
C3, C5, C7, C9, C11, C13, C15, C17, C19 = ((-1) ** k / math.factorial(2 * k + 1) for k in range(1, 10))


@law
def sine(x: float) -> Any:
    """Return the sine of `x` [rad], to 1e-15 below a thousand turns."""
    k = math.floor(x / math.pi + 0.5)
    r = (x - k * _PI_HIGH) - k * _PI_LOW
    q = r * r
    high = C11 + q * (C13 + q * (C15 + q * (C17 + q * C19)))
    odd = k - 2.0 * math.floor(0.5 * k)
    return (1.0 - 2.0 * odd) * (r + r * q * (C3 + q * (C5 + q * (C7 + q * (C9 + q * high)))))
