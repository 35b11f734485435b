"""Elementary functions of our own against the C library's, and at the ends of their ranges."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from rtctl.arithmetic.elementary import (
    acos,
    asin,
    atan,
    atan2,
    atanh,
    cos,
    cosh,
    exp,
    expm1,
    floor,
    log,
    log1p,
    power,
    power_of_two,
    sin,
    sinh,
    sqrt,
    tan,
    tanh,
)

RNG = np.random.default_rng(1)
SMALL = RNG.normal(0.0, 1e-3, 300)
CASES = {
    "exp": (exp, math.exp, np.concatenate((RNG.uniform(-700.0, 700.0, 2000), SMALL))),
    "log": (log, math.log, np.exp(np.concatenate((RNG.uniform(-700.0, 700.0, 2000), SMALL)))),
    "tanh": (tanh, math.tanh, np.concatenate((RNG.uniform(-20.0, 20.0, 2000), SMALL))),
    "expm1": (
        expm1,
        math.expm1,
        np.concatenate((RNG.uniform(-40.0, 40.0, 2000), RNG.uniform(-1.0, 1.0, 2000), SMALL)),
    ),
    "log1p": (
        log1p,
        math.log1p,
        np.concatenate((RNG.uniform(-1.0, 1.0, 2000), RNG.uniform(-0.3, 40.0, 2000), SMALL)),
    ),
    "atan": (
        atan,
        math.atan,
        np.concatenate((RNG.uniform(-1.0, 1.0, 2000), RNG.normal(0.0, 1e3, 2000), SMALL)),
    ),
    "atanh": (atanh, math.atanh, np.concatenate((RNG.uniform(-1.0, 1.0, 2000), SMALL))),
}


@pytest.mark.parametrize("name", CASES)
def test_the_error_is_at_most_two_units_in_the_last_place(name: str) -> None:
    own, library, arguments = CASES[name]
    worst = max(abs(own(x) - library(x)) / math.ulp(library(x)) for x in arguments.tolist())
    assert worst <= 3.0  # two of its own, and half a unit of the library's


def test_ends_of_the_ranges() -> None:
    assert (exp(math.inf), exp(-math.inf), exp(0.0), exp(-800.0)) == (math.inf, 0.0, 1.0, 0.0)
    assert (log(0.0), log(math.inf), log(1.0)) == (-math.inf, math.inf, 0.0)
    assert (tanh(math.inf), tanh(-math.inf), tanh(0.0)) == (1.0, -1.0, 0.0)
    assert (atanh(0.0), atanh(1.0)) == (0.0, math.inf)
    for own, outside in ((exp, math.nan), (log, -1.0), (log, math.nan), (tanh, math.nan), (atanh, 1.5)):
        assert math.isnan(own(outside))


def test_powers_of_two_are_exact() -> None:
    assert all(power_of_two(n) == math.ldexp(1.0, n) for n in range(-1074, 1024))


def test_logarithms_of_the_smallest_numbers() -> None:
    assert log(5e-324) == pytest.approx(math.log(5e-324), rel=1e-15)


@pytest.mark.parametrize(("own", "library"), [(sin, math.sin), (cos, math.cos)])
def test_sine_and_cosine_over_a_thousand_turns(
    own: Callable[[float], float], library: Callable[[float], float]
) -> None:
    angles = np.concatenate(
        (RNG.uniform(-6000.0, 6000.0, 2000), RNG.uniform(-1.0, 1.0, 2000), SMALL)
    ).tolist()
    assert max(abs(own(x) - library(x)) for x in angles) < 3e-16
    assert all(own(x) == pytest.approx(library(x), rel=5e-16) for x in angles[2000:])
    assert math.isnan(own(math.inf))
    assert math.isnan(own(math.nan))


def test_angles_of_points_in_all_quadrants() -> None:
    points = [(y, x) for y in (-2.0, -1e-9, 0.0, 3.0) for x in (-1.5, -1e-6, 0.0, 1e-3, 2.0)]
    assert [atan2(*point) for point in points] == pytest.approx(
        [math.atan2(*point) for point in points], rel=4e-16
    )
    assert math.isnan(atan2(math.nan, 1.0))


WITHIN = np.concatenate((RNG.uniform(-1.0, 1.0, 2000), SMALL, [-1.0, 1.0, 0.0]))
FURTHER = {
    "asin": (asin, math.asin, WITHIN),
    "acos": (acos, math.acos, WITHIN),
    "sinh": (sinh, math.sinh, np.concatenate((RNG.uniform(-700.0, 700.0, 2000), SMALL))),
    "cosh": (cosh, math.cosh, np.concatenate((RNG.uniform(-700.0, 700.0, 2000), SMALL))),
    "tan": (tan, math.tan, np.concatenate((RNG.uniform(-1.5, 1.5, 2000), SMALL))),
}


@pytest.mark.parametrize("name", FURTHER)
def test_the_error_of_what_is_made_of_others_is_at_most_five_units(name: str) -> None:
    own, library, arguments = FURTHER[name]
    worst = max(abs(own(x) - library(x)) / math.ulp(library(x)) for x in arguments.tolist())
    assert worst <= 5.0


def test_powers_within_their_bound() -> None:
    for x, y in np.column_stack(
        (10.0 ** RNG.uniform(-6.0, 6.0, 2000), RNG.uniform(-20.0, 20.0, 2000))
    ).tolist():
        exact = math.pow(x, y)
        assert abs(power(x, y) - exact) <= (3.0 + 2.0 * abs(y * math.log(x))) * math.ulp(exact)
    assert (power(-2.0, 3.0), power(-2.0, 2.0)) == (pytest.approx(-8.0), pytest.approx(4.0))
    assert (power(0.0, 2.5), power(0.0, -1.0), power(-3.0, 0.0)) == (0.0, math.inf, 1.0)
    assert math.isnan(power(-2.0, 0.5))


def test_floor_is_that_of_python_and_roots_of_less_than_zero_are_no_numbers() -> None:
    places = [*RNG.uniform(-1e6, 1e6, 500).tolist(), -1.0, -0.5, 0.0, 0.5, 3.0]
    assert [floor(x) for x in places] == [math.floor(x) for x in places]
    assert floor(1e18) == 1e18
    assert math.isnan(floor(math.nan))
    assert math.isnan(sqrt(-1e-300))
    assert sqrt(2.0) == math.sqrt(2.0)
