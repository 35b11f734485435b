"""Mixing laws at their limits and against their own equations; deflection is the sum that it says."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant_sim.kernels import pack
from plant_sim.vo2.deflection import Deflection, deflection_at
from plant_sim.vo2.resistance import Resistance, bruggeman, resistance_at, semiconductor_at

LAWS = ["logarithmic", "bruggeman", "series"]
FRACTION = st.floats(0.0, 1.0)
TEMPERATURE = st.floats(20.0, 95.0)
EA, R0, RM = 3000.0, 10.0, 8000.0


def film(mixing: str, dimension: float = 2.0):
    tables = {
        "mixing": mixing,
        "prefactor": f"{R0} ohm",
        "activation": f"{EA} K",
        "metal": "8 kohm",
        "dimension": dimension,
    }
    return pack(Resistance.model_validate(tables))[0]


def semiconductor(temperature: float) -> float:
    return R0 * math.exp(EA / (temperature + 273.15))


@given(temperature=TEMPERATURE)
@pytest.mark.parametrize("mixing", LAWS)
def test_an_untransformed_film_is_an_arrhenius_semiconductor(mixing, temperature):
    in_series = RM if mixing == "series" else 0.0
    expected = semiconductor(temperature) + in_series
    assert resistance_at(film(mixing), temperature, 0.0) == pytest.approx(expected, rel=1e-9)


@given(temperature=TEMPERATURE)
@pytest.mark.parametrize("mixing", LAWS)
def test_a_transformed_film_is_the_metal(mixing, temperature):
    assert resistance_at(film(mixing), temperature, 1.0) == pytest.approx(RM, rel=1e-9)


@given(temperature=TEMPERATURE, low=FRACTION, high=FRACTION)
@pytest.mark.parametrize("mixing", LAWS)
def test_resistance_falls_as_the_film_transforms(mixing, temperature, low, high):
    low, high = sorted((low, high))
    at_low, at_high = (resistance_at(film(mixing), temperature, f) for f in (low, high))
    assert at_high <= at_low * (1.0 + 1e-12)


@given(fraction=FRACTION)
def test_logarithmic_mixing_is_a_straight_line_in_ln_r(fraction):
    expected = (1.0 - fraction) * math.log(semiconductor(60.0)) + fraction * math.log(RM)
    assert math.log(resistance_at(film("logarithmic"), 60.0, fraction)) == pytest.approx(expected, rel=1e-12)


@given(fraction=FRACTION, dimension=st.floats(1.2, 3.0))
def test_bruggeman_satisfies_the_effective_medium_equation(fraction, dimension):
    g_s, g_m = 1.0 / 100e3, 1.0 / 8e3
    g = 1.0 / bruggeman(1.0 / g_s, 1.0 / g_m, fraction, dimension)
    metal = fraction * (g_m - g) / (g_m + (dimension - 1.0) * g)
    rest = (1.0 - fraction) * (g_s - g) / (g_s + (dimension - 1.0) * g)
    assert metal + rest == pytest.approx(0.0, abs=1e-9)
    assert g_s * (1.0 - 1e-12) <= g <= g_m * (1.0 + 1e-12)


def test_a_half_transformed_plane_conducts_as_the_geometric_mean():
    """Dykhne 1971: exact in two dimensions, whatever the geometry."""
    assert bruggeman(100e3, 9e3, 0.5, 2.0) == pytest.approx(30e3, rel=1e-12)


def test_the_activation_is_the_slope_of_ln_r_against_one_over_kelvin():
    cold, warm = semiconductor_at(R0, EA, 20.0), semiconductor_at(R0, EA, 60.0)
    assert math.log(cold / warm) / (1.0 / 293.15 - 1.0 / 333.15) == pytest.approx(EA, rel=1e-12)


def test_deflection_adds_stroke_and_expansion():
    beam = pack(Deflection.model_validate({"rest": "0.01 mm", "stroke": "60 um", "expansion": "-0.4 um/K"}))
    assert deflection_at(beam[0], 20.0, 0.25) == pytest.approx(10.0 + 15.0 - 8.0, rel=1e-12)
