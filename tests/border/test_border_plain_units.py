"""A unit of the data stands in a parameter's unit without brackets that change nothing, wherever it is written."""

from __future__ import annotations

import re

import pytest

from plant_sim.oscillator.mechanism import in_units
from plant_sim.oscillator.mechanisms import MECHANISMS
from plant_sim.oscillator.nominal import NOMINAL_PARAMETERS
from rtctl.border.mechanisms import plain_unit, without_brackets
from rtctl.border.units.quantities import convert

NEEDLESS = re.compile(r"(?<!\w)\(\w+\)|\(\([^()]*\)\)")


@pytest.mark.parametrize(("z", "u"), [("mm", "N"), ("um", "V"), ("rad", "N*m"), ("m/s", "dimensionless")])
def test_no_parameter_of_an_oscillator_has_needless_brackets(z: str, u: str) -> None:
    mechanisms = [in_units(one, {"displacement": z, "drive": u}) for one in MECHANISMS.values()]
    declared = [*NOMINAL_PARAMETERS, *(one for mechanism in mechanisms for one in mechanism.parameters)]
    for one in declared:
        unit = one.unit_in(z=z, u=u, y=z)
        assert not NEEDLESS.search(unit), unit
        with_all = one.unit.format(z=f"({z})", u=f"({u})", y=f"({z})")
        assert convert(1.0, with_all, unit) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("given", "plain"),
    [
        ("1/((mm)^2*s^2)", "1/(mm^2*s^2)"),
        ("(mm)/(s^2*((N)))", "mm/(s^2*N)"),
        ("(m/s)/V", "(m/s)/V"),
        ("((N/(kg*m)))", "N/(kg*m)"),
        ("(a)*(b*c)", "a*(b*c)"),
        ("(a*b)*(c*d)", "(a*b)*(c*d)"),
        ("ln(ohm)", "ln(ohm)"),
        ("(dimensionless)", "dimensionless"),
    ],
)
def test_brackets_that_matter_stay(given: str, plain: str) -> None:
    assert without_brackets(given) == plain
    assert plain_unit(given) == plain.removeprefix("dimensionless")
