"""Elementary functions that are compiled for several lanes at once, beside those of the C library."""

from __future__ import annotations

import math
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant_sim.oscillator.equation.elementary import fading, power, soft_sign, two_to

NEAR = 1e-12


@given(st.floats(-1000.0, 1000.0))
def test_a_power_of_two_is_that_of_the_library(y: float) -> None:
    assert two_to(y) == pytest.approx(2.0**y, rel=NEAR)


@given(st.floats(sys.float_info.min, 1e300), st.floats(0.0, 10.0))
def test_a_power_is_that_of_the_library(x: float, e: float) -> None:
    if abs(e * math.log2(x)) < 1000.0:
        assert power(x, e) == pytest.approx(x**e, rel=NEAR * max(1.0, abs(e * math.log2(x))))


def test_a_power_of_nothing_is_nothing_beside_one() -> None:
    assert 0.0 <= power(0.0, 0.5) < 1e-150
    assert power(1.0, 3.0) == 1.0


@given(st.floats(0.0, 1e6))
def test_a_fading_exponential_is_that_of_the_library(x: float) -> None:
    assert fading(x) == pytest.approx(math.exp(-x), rel=NEAR, abs=1e-17)


@given(st.floats(-1e6, 1e6))
def test_a_soft_sign_is_the_hyperbolic_tangent(x: float) -> None:
    assert soft_sign(x) == pytest.approx(math.tanh(x), rel=1e-9, abs=1e-12)
