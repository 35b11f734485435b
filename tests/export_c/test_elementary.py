"""Elementary functions of our own against the C library's, and at the ends of their ranges."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from rtctl.arithmetic.elementary import (
    atan,
    atan2,
    atanh,
    cos,
    exp,
    expm1,
    log,
    log1p,
    power_of_two,
    sin,
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
