"""exp, log, tanh, atanh by + - * / alone: the same bits on every processor, in every C library, and in exported C.

    exp x = 2^n (1 + 2 r P(r^2) / (Q(r^2) - r P(r^2))),   n = round(x / ln 2),   r = x - n ln 2
    log x = k ln 2 + log(1 + f),   s = f / (2 + f),   log(1 + f) = f - (f^2/2 - s (f^2/2 + s^2 L(s^2)))
    tanh x = x + x^3 P(x^2) / Q(x^2) below 0.625, 1 - 2 / (exp(2 x) + 1) beyond
    atanh x = x + x^3 P(x^2) / Q(x^2) below 0.5, log((1 + x) / (1 - x)) / 2 beyond

ln 2 is held in two parts, the first of which n times is exact in double and in single precision. Accurate to 2 units in
the last place. A C library's functions differ from another's in the last bits, and so would a loop that uses them.

References: S. L. Moshier, Cephes, exp.c, tanh.c, atanh.c; Sun Microsystems, fdlibm, e_log.c.
"""

from __future__ import annotations

import math

from rtctl.border.kernels import kernel

LN2_HIGH = 0.693145751953125
"""ln 2 to 14 bits."""
LN2_LOW = 1.42860682030941723212e-6
"""What is missing of it."""
PER_LN2 = 1.4426950408889634074
MOST_EXPONENT, LEAST_EXPONENT = 709.0, -745.0
"""Beyond them exp is infinite or zero, in double precision."""
SQRT2 = 1.4142135623730951


@kernel
def power_of_two(n: int) -> float:
    """Return 2^n, exactly; infinite or zero where it has no number."""
    factor = 2.0 if n >= 0 else 0.5
    left = abs(n)
    power = 1.0
    while left > 0:
        if left % 2 == 1:
            power *= factor
        factor *= factor
        left = left // 2
    return power


@kernel
def exp(x: float) -> float:
    """Return e^x."""
    if not x <= MOST_EXPONENT:
        return x if x != x else math.inf
    if x < LEAST_EXPONENT:
        return 0.0
    scaled = PER_LN2 * x
    n = int(scaled + 0.5) if scaled >= 0.0 else int(scaled - 0.5)
    r = (x - n * LN2_HIGH) - n * LN2_LOW
    z = r * r
    p = r * ((1.26177193074810590878e-4 * z + 3.02994407707441961300e-2) * z + 1.0)
    q = (
        (3.00198505138664455042e-6 * z + 2.52448340349684104192e-3) * z + 2.27265548208155028766e-1
    ) * z + 2.0
    return (1.0 + 2.0 * (p / (q - p))) * power_of_two(n)


@kernel
def log(x: float) -> float:
    """Return the natural logarithm; -inf of 0, NaN of less."""
    if not 0.0 < x < math.inf:
        if x == 0.0:
            return -math.inf
        return x if x > 0.0 else math.nan
    m, k = x, 0
    while m >= 65536.0:
        m *= 1.52587890625e-5
        k += 16
    while m < 1.0:
        m *= 65536.0
        k -= 16
    if m >= 256.0:
        m *= 0.00390625
        k += 8
    if m >= 16.0:
        m *= 0.0625
        k += 4
    if m >= 4.0:
        m *= 0.25
        k += 2
    if m >= 2.0:
        m *= 0.5
        k += 1
    if m > SQRT2:
        m *= 0.5
        k += 1
    f = m - 1.0
    s = f / (2.0 + f)
    z = s * s
    series = 1.531383769920937332e-1 + z * 1.479819860511658591e-1
    series = 2.222219843214978396e-1 + z * (1.818357216161805012e-1 + z * series)
    series = 6.666666666666735130e-1 + z * (
        3.999999999940941908e-1 + z * (2.857142874366239149e-1 + z * series)
    )
    half = 0.5 * f * f
    return k * LN2_HIGH - ((half - (s * (half + z * series) + k * LN2_LOW)) - f)


@kernel
def tanh(x: float) -> float:
    """Return the hyperbolic tangent."""
    size = abs(x)
    if size >= 0.625:
        y = 1.0 - 2.0 / (exp(2.0 * size) + 1.0)
        return y if x > 0.0 else -y
    z = x * x
    p = (-9.64399179425052238628e-1 * z - 9.92877231001918586564e1) * z - 1.61468768441708447952e3
    q = ((z + 1.12811678491632931402e2) * z + 2.23548839060100448583e3) * z + 4.84406305325125486048e3
    return x + x * z * (p / q)


@kernel
def atanh(x: float) -> float:
    """Return the inverse hyperbolic tangent; infinite at +-1, NaN beyond."""
    if not abs(x) < 0.5:
        return 0.5 * log((1.0 + x) / (1.0 - x))
    z = x * x
    p = (-8.54074331929669305196e-1 * z + 1.20426861384072379242e1) * z - 4.61252884198732692637e1
    p = (p * z + 6.54566728676544377376e1) * z - 3.09092539379866942570e1
    q = ((z - 1.95638849376911654834e1) * z + 1.08938092147140262656e2) * z - 2.49839401325893582852e2
    q = (q * z + 2.52006675691344555838e2) * z - 9.27277618139601130017e1
    return x + x * z * (p / q)
