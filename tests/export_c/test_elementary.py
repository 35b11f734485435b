"""exp, log, tanh, atanh of our own against the C library's, and at the ends of their ranges."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rtctl.arithmetic.elementary import atanh, exp, log, power_of_two, tanh

RNG = np.random.default_rng(1)
SMALL = RNG.normal(0.0, 1e-3, 300)
CASES = {
    "exp": (exp, math.exp, np.concatenate((RNG.uniform(-700.0, 700.0, 2000), SMALL))),
    "log": (log, math.log, np.exp(np.concatenate((RNG.uniform(-700.0, 700.0, 2000), SMALL)))),
    "tanh": (tanh, math.tanh, np.concatenate((RNG.uniform(-20.0, 20.0, 2000), SMALL))),
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
