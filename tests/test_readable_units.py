"""Numbers for people are between 1 and 1000 where their unit takes an SI prefix, and are the same quantity."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.border.units.quantities import convert
from rtctl.output.readable_units import (
    printed_unit,
    readable,
    readable_unit,
    significant,
    with_standard_error,
)


@settings(deadline=None)  # the first unit builds the registry
@given(
    exponent=st.floats(-9.0, 8.0),
    unit=st.sampled_from(["um", "mm", "cm", "m", "ohm", "kohm", "V", "mA", "mm/s^2", "um/s", "N", "Hz"]),
)
def test_it_is_the_same_quantity_and_reads_well(exponent: float, unit: str) -> None:
    size = 10.0**exponent
    scaled = readable_unit(size, unit)
    assert convert(scaled.of(size), scaled.unit, unit) == pytest.approx(size, rel=1e-12)
    if 1e-10 < convert(size, unit, unit.replace("mm/", "m/").replace("um/", "m/")) < 1e9:
        number = float(f"{scaled.of(size):.4g}")
        assert 0.9999 <= number < 1000.0 or scaled.unit[0] in "pG" or ("/" in unit and 0.01 <= number < 1e4)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (10.8, "ohm", "10.8 ohm"), (0.0108, "kohm", "10.8 ohm"), (143_200.0, "ohm", "143.2 kohm"),
        (4.2e-4, "mm", "420 nm"), (0.0018, "s", "1.8 ms"), (5000.0, "s", "5000 s"), (999.96, "um", "1 mm"),
        (0.0, "mm", "0 mm"), (float("nan"), "mm", "nan mm"), (3e-7, "1/mm^2", "3e-07 1/mm^2"), (0.4, "1", "0.4"),
        (2500.0, "m^2/s", "2500 m^2/s"), (0.02, "rad", "0.02 rad"), (-0.0031, "V", "-3.1 mV"), (12.0, "min", "12 min"),
        (450.0, "mm/s^2", "450 mm/s^2"), (4500.0, "mm/s^2", "4500 mm/s^2"), (0.028, "mm/V", "0.028 mm/V"),
        (0.0021, "mm/s^2", "2.1 um/s^2"),
    ],
)  # fmt: skip
def test_units_that_take_no_prefix_stay_and_the_others_fit_their_size(
    value: float, unit: str, text: str
) -> None:
    assert readable(value, unit) == text


@pytest.mark.parametrize(
    ("unit", "printed"),
    [
        ("um", "µm"), ("kohm", "kΩ"), ("ln ohm", "ln Ω"), ("mm/(s^2*V)", "mm/(s²·V)"), ("1/(mm^2*s^2)", "1/(mm²·s²)"),
        ("cm^0.5/s", "cm⁰·⁵/s"), ("deg", "°"), ("dimensionless", "dimensionless"), ("uV", "µV"), ("um/s^2", "µm/s²"),
        ("uC", "µC"), ("1/us", "1/µs"), ("union", "union"),
        ("1/degC", "1/°C"), ("degree", "degree"),
    ],
)  # fmt: skip
def test_units_are_printed_with_their_signs(unit: str, printed: str) -> None:
    assert printed_unit(unit) == printed


def test_a_number_of_few_digits_has_no_power_of_ten() -> None:
    assert readable(1.9e-4, "um", 2) == "190 pm"
    assert readable(12345.0, "rad", 2) == "1.2e+04 rad"


@pytest.mark.parametrize(
    ("value", "error", "unit", "text"),
    [
        (26.000145, 1.02e-4, "Hz", "26.00014 Hz, standard error 0.0001 Hz"),
        (-2.000391e9, 1.9e5, "1/(m^2*s^2)", "-2.00039e+09 1/(m^2*s^2), standard error 1.9e+05 1/(m^2*s^2)"),
        (12304.04, 0.25, "1/s^2", "12304.04 1/s^2, standard error 0.25 1/s^2"),
        (33.000001, 1.5e-4, "Hz", "33.00000 Hz, standard error 0.00015 Hz"),
        (-4.1e8, 3.0e9, "1/s^2", "-4.1e+08 1/s^2, standard error 3e+09 1/s^2"),
        (0.0, 3.0e9, "1/s^2", "0 1/s^2, standard error 3e+09 1/s^2"),
        (0.0, 0.002, "mm", "0.0 um, standard error 2 um"),
        (1.8, 0.0, "%", "1.8 %"),
    ],
)
def test_a_value_with_its_standard_error_has_the_digits_that_the_error_supports(
    value: float, error: float, unit: str, text: str
) -> None:
    assert with_standard_error(value, error, unit) == text


def test_a_large_number_reads_alike_with_and_without_its_interval() -> None:
    assert significant(-2.000391e9, -2.000391e9 - 4e5, -2.000391e9 + 4e5)[0] == "-2.00039e+09"
    assert significant(12304.04, 12303.56, 12304.52) == ("12304.04", "12303.56", "12304.52")


def test_what_is_infinite_is_without_bound() -> None:
    assert readable(float("inf"), "cm") == "without bound"
