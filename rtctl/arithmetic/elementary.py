"""Elementary functions by + - * / alone: the same bits on every processor, in every C library, and in exported C.

    exp x = 2^n (1 + 2 r P(r^2) / (Q(r^2) - r P(r^2))),   n = round(x / ln 2),   r = x - n ln 2
    log x = k ln 2 + log(1 + f),   s = f / (2 + f),   log(1 + f) = f - (f^2/2 - s (f^2/2 + s^2 L(s^2)))
    tanh x = x + x^3 P(x^2) / Q(x^2) below 0.625, 1 - 2 / (exp(2 x) + 1) beyond
    atanh x = x + x^3 P(x^2) / Q(x^2) below 0.5, log((1 + x) / (1 - x)) / 2 beyond
    expm1 x = 2 r P(r^2) / (Q(r^2) - r P(r^2)) of r = x below 0.5, exp x - 1 beyond; log1p likewise by the series of log
    sin x, cos x by polynomials of r = x - n pi / 2, |r| <= pi / 4, in the quadrant n
    atan x = x + x^3 P(x^2) / Q(x^2) below 0.66, by pi / 4 + atan((x - 1) / (x + 1)) and pi / 2 - atan(1 / x) beyond
    asin x = atan(x / sqrt((1 - x) (1 + x))),   acos x = 2 atan(sqrt((1 - x) / (1 + x)))
    x^y = exp(y log x)

ln 2 is held in two parts, the first of which n times is exact in double and in single precision, and pi / 2 in three.
Accurate to 2 units in the last place (sine and cosine up to a thousand turns, away from their zeros; asin, acos, sinh,
cosh and tan to 5; x^y to 3 + 2 |y log x|). A C library's functions differ from another's in the last bits, and so would
a loop that uses them.

References: S. L. Moshier, Cephes, exp.c, tanh.c, atanh.c, unity.c, sin.c, atan.c; Sun Microsystems, fdlibm, e_log.c.
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
HALF_PI_HIGH, HALF_PI_MIDDLE, HALF_PI_LOW = 1.5703125, 4.837512969970703125e-4, 7.54978995489188216e-8
"""pi / 2 in three parts; some thousand times the first and the second are exact, also in single precision."""
PER_HALF_PI = 0.63661977236758134308
PI, HALF_PI, QUARTER_PI = 3.14159265358979323846, 1.57079632679489661923, 0.78539816339744830962
DEGREES = 57.295779513082320877
"""Degrees of a radian."""
TAN_3PI_8 = 2.41421356237309504880
WHOLE = 2147483000.0
"""Beyond it `floor` takes each number for a whole one: an integer of 32 bits does not hold it."""
LOG_HALF = -0.2928932188134524
"""sqrt(1/2) - 1: from here to sqrt(2) - 1 the series of log takes log1p as it is."""


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
def half_of_expm1(r: float) -> float:
    """Return (e^r - 1) / 2 for |r| <= 1/2."""
    z = r * r
    p = r * ((1.26177193074810590878e-4 * z + 3.02994407707441961300e-2) * z + 1.0)
    q = (
        (3.00198505138664455042e-6 * z + 2.52448340349684104192e-3) * z + 2.27265548208155028766e-1
    ) * z + 2.0
    return p / (q - p)


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
    return (1.0 + 2.0 * half_of_expm1(r)) * power_of_two(n)


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
    return log_of_parts(m - 1.0, k)


@kernel
def log_of_parts(f: float, k: int) -> float:
    """Return log(2^k (1 + f)) for 1 + f from sqrt(1/2) to sqrt(2)."""
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


@kernel
def expm1(x: float) -> float:
    """Return e^x - 1, accurate where x is small."""
    if not abs(x) <= 0.5:
        return exp(x) - 1.0
    return 2.0 * half_of_expm1(x)


@kernel
def log1p(x: float) -> float:
    """Return log(1 + x), accurate where x is small; -inf of -1, NaN of less."""
    if not LOG_HALF < x < SQRT2 - 1.0:
        return log(1.0 + x)
    return log_of_parts(x, 0)


@kernel
def quadrant(x: float) -> int:
    """Return the whole number of right angles nearest to x [rad]."""
    turns = PER_HALF_PI * x
    return int(turns + 0.5) if turns >= 0.0 else int(turns - 0.5)


@kernel
def sine_part(r: float) -> float:
    """Return sin r for |r| <= pi / 4."""
    z = r * r
    p = (1.58962301576546568060e-10 * z - 2.50507477628578072866e-8) * z + 2.75573136213857245213e-6
    p = ((p * z - 1.98412698295895385996e-4) * z + 8.33333333332211858878e-3) * z - 1.66666666666666307295e-1
    return r + r * z * p


@kernel
def cosine_part(r: float) -> float:
    """Return cos r for |r| <= pi / 4."""
    z = r * r
    p = (-1.13585365213876817300e-11 * z + 2.08757008419747316778e-9) * z - 2.75573141792967388112e-7
    p = ((p * z + 2.48015872888517045348e-5) * z - 1.38888888888730564116e-3) * z + 4.16666666666665929218e-2
    return 1.0 - 0.5 * z + z * z * p


@kernel
def sine_ahead(x: float, ahead: int) -> float:
    """Return the sine of `ahead` right angles more than x [rad]."""
    if not abs(x) < math.inf:
        return math.nan
    n = quadrant(x)
    r = ((x - n * HALF_PI_HIGH) - n * HALF_PI_MIDDLE) - n * HALF_PI_LOW
    q = (n + ahead) % 4
    y = sine_part(r) if q % 2 == 0 else cosine_part(r)
    return -y if q >= 2 else y


@kernel
def sin(x: float) -> float:
    """Return the sine of x [rad]; NaN where x is not finite."""
    return sine_ahead(x, 0)


@kernel
def cos(x: float) -> float:
    """Return the cosine of x [rad]; NaN where x is not finite."""
    return sine_ahead(x, 1)


@kernel
def atan(x: float) -> float:
    """Return the inverse tangent [rad]."""
    size = abs(x)
    base, t = 0.0, size
    if size > TAN_3PI_8:
        base, t = HALF_PI, -1.0 / size
    elif size > 0.66:
        base, t = QUARTER_PI, (size - 1.0) / (size + 1.0)
    z = t * t
    p = (-8.750608600031904122785e-1 * z - 1.615753718733365076637e1) * z - 7.500855792314704667340e1
    p = (p * z - 1.228866684490136173410e2) * z - 6.485021904942025371773e1
    q = ((z + 2.485846490142306297962e1) * z + 1.650270098316988542046e2) * z + 4.328810604912902668951e2
    q = (q * z + 4.853903996359136964868e2) * z + 1.945506571482613964425e2
    y = base + (t + t * z * (p / q))
    return -y if x < 0.0 else y


@kernel
def atan2(y: float, x: float) -> float:
    """Return the angle [rad] of the point (x, y), from -pi to pi; 0 of the origin."""
    if x == 0.0:
        return 0.0 if y == 0.0 else math.copysign(HALF_PI, y)
    angle = atan(y / x)
    if x > 0.0:
        return angle
    return angle + PI if y >= 0.0 else angle - PI


@kernel
def asin(x: float) -> float:
    """Return the inverse sine [rad]; NaN beyond +-1."""
    return atan2(x, sqrt((1.0 - x) * (1.0 + x)))


@kernel
def acos(x: float) -> float:
    """Return the inverse cosine [rad]; NaN beyond +-1."""
    return 2.0 * atan2(sqrt(1.0 - x), sqrt(1.0 + x))


@kernel
def tan(x: float) -> float:
    """Return the tangent of x [rad]; NaN where x is not finite."""
    return sine_ahead(x, 0) / sine_ahead(x, 1)


@kernel
def sinh(x: float) -> float:
    """Return the hyperbolic sine."""
    e = expm1(abs(x))
    if not e < math.inf:
        return x if x != x else math.copysign(math.inf, x)
    return math.copysign(0.5 * (e + e / (e + 1.0)), x)


@kernel
def cosh(x: float) -> float:
    """Return the hyperbolic cosine."""
    e = exp(abs(x))
    return 0.5 * (e + 1.0 / e)


@kernel
def sqrt(x: float) -> float:
    """Return the square root; NaN of less than 0."""
    return math.nan if x < 0.0 else math.sqrt(x)


@kernel
def fabs(x: float) -> float:
    """Return the size of x."""
    return abs(x)


@kernel
def floor(x: float) -> float:
    """Return the largest whole number that is not above x."""
    if not abs(x) < WHOLE:
        return x
    n = float(int(x))
    return n - 1.0 if n > x else n


@kernel
def power(x: float, y: float) -> float:
    """Return x^y; of a negative x where y is whole, else NaN."""
    if y == 0.0 or x == 1.0:
        return 1.0
    if x > 0.0:
        return exp(y * log(x))
    if x == 0.0:
        return 0.0 if y > 0.0 else math.inf
    if x < 0.0 and floor(y) == y:
        size = exp(y * log(-x))
        return size if floor(0.5 * y) == 0.5 * y else -size
    return math.nan
