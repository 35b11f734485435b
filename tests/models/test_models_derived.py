"""Natural frequency, damping, wells and forces follow from parameters by the formulas of the textbook, in any units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pytest

from rtctl.models.derived.oscillator import derive_oscillator
from rtctl.models.derived.quantity import Derived, derive


class One(NamedTuple):
    value: float
    low: float
    high: float
    unit: str


def estimate(value: float, unit: str, half: float = 0.0) -> One:
    return One(value, value - half, value + half, unit)


def by_name(estimates: Mapping[str, Mapping[str, One]], units: Mapping[str, str]) -> dict[str, Derived]:
    return {one.name: one for one in derive_oscillator(estimates, units)}


RESONATOR = {
    "damping": estimate(4.0, "1/s", 0.4),
    "stiffness": estimate((2.0 * math.pi * 15.0) ** 2, "1/s^2"),
    "drive_gain": estimate(300.0, "mm/(s^2*V)"),
}


def test_a_resonator_has_its_textbook_figures() -> None:
    found = by_name({"": RESONATOR}, {"drive": "V", "displacement": "mm"})
    assert found["natural frequency"].value == pytest.approx(15.0)
    ratio = 4.0 / (2.0 * 2.0 * math.pi * 15.0)
    assert (found["damping ratio"].value, found["damping ratio"].unit) == (pytest.approx(100.0 * ratio), "%")
    assert found["damping ratio"].high == pytest.approx(110.0 * ratio)
    assert found["quality factor Q"].value == pytest.approx(0.5 / ratio)
    assert found["static deflection per drive"].value == pytest.approx(300.0 / (2.0 * math.pi * 15.0) ** 2)


@pytest.mark.parametrize(
    ("stop", "where", "frequency"),
    [
        ({"above": (3e4, "1/s^2"), "place": (0.2, "mm")}, "off", 15.0),
        ({"below": (3e4, "1/s^2"), "place": (0.2, "mm")}, "on", math.hypot(15.0, math.sqrt(3e4) / (2.0 * math.pi))),
        ({"below": (3e4, "1/s^2"), "place": (-0.2, "mm")}, "off", 15.0),
        ({"stiffness": (3e4, "1/s^2"), "lower": (-0.1, "mm"), "upper": (0.2, "mm")}, "off", 15.0),
        ({"stiffness": (3e-2, "1/ms^2"), "lower": (0.1, "mm"), "upper": (0.2, "mm")}, "on",
         math.hypot(15.0, math.sqrt(3e4) / (2.0 * math.pi))),
    ],
)  # fmt: skip
def test_beside_a_stop_the_frequency_is_that_off_it_unless_the_device_rests_on_it(
    stop: Mapping[str, tuple[float, str]], where: str, frequency: float
) -> None:
    estimates = {name: estimate(*value) for name, value in stop.items()}
    identity = "stop.two_sided" if "lower" in stop else "stop.one_sided"
    found = by_name({"": RESONATOR, identity: estimates}, {"drive": "V", "displacement": "mm"})
    assert found[f"natural frequency {where} the stop"].value == pytest.approx(frequency)
    assert "natural frequency" not in found


def test_a_friction_is_a_drive_whatever_the_units_of_the_parameters() -> None:
    friction = {"friction.coulomb": {"level": estimate(0.45, "m/s^2", 0.01)}}
    found = by_name({"": RESONATOR, **friction}, {"drive": "mV", "displacement": "um"})
    one = found["friction.coulomb, level as a drive"]
    assert (one.value, one.unit) == (pytest.approx(1500.0), "mV")
    assert one.high - one.value == pytest.approx(1500.0 * 0.01 / 0.45)


def test_a_constant_drive_moves_the_rest_position() -> None:
    offset = {"drive.offset": {"offset": estimate(2.0, "V")}}
    found = by_name({"": RESONATOR, **offset}, {"drive": "V", "displacement": "um"})
    assert found["rest position moved by drive.offset"].value == pytest.approx(
        6e5 / (2.0 * math.pi * 15.0) ** 2
    )


def test_two_wells_are_where_the_force_vanishes_and_leave_at_its_maximum() -> None:
    k, k3, gain = -395.0, 6700.0, 34.0
    beam = {
        "damping": estimate(1.6, "1/s"), "stiffness": estimate(k, "1/s^2"),
        "stiffness_cubic": estimate(k3, "1/(mm^2*s^2)"), "drive_gain": estimate(gain, "mm/(s^2*N)"),
    }  # fmt: skip
    found = by_name({"": beam}, {"drive": "N", "displacement": "mm"})
    well = found["displacement in a well"].value
    assert k * well + k3 * well**3 == pytest.approx(0.0, abs=1e-9)
    rate = math.sqrt(k + 3.0 * k3 * well**2)
    assert found["natural frequency in a well"].value == pytest.approx(rate / (2.0 * math.pi))
    assert found["quality factor Q in a well"].value == pytest.approx(rate / 1.6)
    z = np.linspace(0.0, well, 100_001)
    assert found["steady drive that leaves rest in a well"].value == pytest.approx(
        np.max(-(k * z + k3 * z**3)) / gain
    )


def test_a_fifth_order_term_and_an_even_one_move_the_wells_and_their_frequencies() -> None:
    k, k2, k3, k5 = -395.0, 60.0, 6700.0, 4000.0
    beam = {"stiffness": estimate(k, "1/s^2"), "stiffness_cubic": estimate(k3, "1/(mm^2*s^2)")}
    more = {
        "stiffness.quadratic": {"coefficient": estimate(k2, "1/(mm*s^2)")},
        "stiffness.quintic": {"coefficient": estimate(k5, "1/(mm^4*s^2)")},
    }
    found = by_name({"": beam, **more}, {"drive": "N", "displacement": "um"})
    for side, name in ((1.0, "upper"), (-1.0, "lower")):
        z = 1e-3 * found[f"displacement in the {name} well"].value
        assert side * z > 0.0
        assert k * z + k2 * z**2 + k3 * z**3 + k5 * z**5 == pytest.approx(0.0, abs=1e-6)
        rate = math.sqrt(k + 2.0 * k2 * z + 3.0 * k3 * z**2 + 5.0 * k5 * z**4)
        assert found[f"natural frequency in the {name} well"].value == pytest.approx(rate / (2.0 * math.pi))


def test_a_spring_that_the_stiffness_alone_does_not_tell_has_no_natural_frequency() -> None:
    pendulum = {"stiffness.gravity": {"coefficient": estimate(9.0, "1/s^2")}}
    assert by_name({"": RESONATOR, **pendulum}, {"drive": "V", "displacement": "mm"}) == {}


def test_a_body_without_a_spring_has_a_time_constant_only() -> None:
    found = by_name({"": {"damping": estimate(2.0, "1/s")}}, {"drive": "V", "displacement": "mm"})
    assert {name: one.value for name, one in found.items()} == {"time constant of the speed": 0.5}


FREE = {"damping": estimate(25.0, "1/s", 0.5), "drive_gain": estimate(1100.0, "mm/(s^2*V)", 10.0)}
UNITS = {"drive": "V", "displacement": "mm"}
NEEDS_SPRING = (
    "natural frequency",
    "well",
    "quality factor",
    "damping ratio",
    "static deflection",
    "rest position",
)


def told_without_spring(
    stiffness: One, *, longest_s: float = 0.0, damping: One | None = None
) -> dict[str, float]:
    """Return what is told of a valve or an axis with an offset of its drive; fails where it needs a spring."""
    nominal = {**FREE, "stiffness": stiffness, "stiffness_cubic": estimate(17.0, "1/(mm^2*s^2)")}
    offset = {"drive.offset": {"offset": estimate(-0.08, "V", 0.001)}}
    body = {"": nominal | ({} if damping is None else {"damping": damping}), **offset}
    found = {one.name: one.value for one in derive_oscillator(body, UNITS, 100.0, longest_s)}
    assert not [name for name in found if any(word in name for word in NEEDS_SPRING)]
    return found


def test_a_body_without_a_spring_has_a_time_constant_and_a_steady_speed() -> None:
    found = told_without_spring(estimate(8.3e-5, "1/s^2", 1.96 * 5.5e-5))
    assert found == {"time constant of the speed": 0.04, "steady speed per drive": pytest.approx(44.0)}


@pytest.mark.parametrize(
    ("stiffness", "longest_s"),
    [
        pytest.param(estimate(-0.2, "1/s^2", 0.2), 0.0, id="wells within their interval"),
        pytest.param(
            estimate(-0.37, "1/s^2"), 30.0, id="wells without an interval in which nothing oscillates"
        ),
        pytest.param(estimate(9.4e-5, "1/s^2", 3.9e-5), 25.0, id="a certain spring of a period of 650 s"),
        pytest.param(estimate(0.05, "1/s^2", 0.001), 10.0, id="a certain spring that acts after 500 s"),
        pytest.param(estimate(0.0, "1/s^2"), 0.0, id="none"),
    ],
)
def test_nothing_is_derived_from_a_spring_that_is_not_certain_or_acts_in_no_record(
    stiffness: One, longest_s: float
) -> None:
    assert "steady speed per drive" in told_without_spring(stiffness, longest_s=longest_s)


def test_a_damping_that_may_be_zero_gives_no_time_constant() -> None:
    uncertain = estimate(0.1, "1/s", 0.2)
    assert told_without_spring(estimate(0.0, "1/s^2"), damping=uncertain) == {}


def test_a_spring_that_acts_within_the_records_keeps_its_figures() -> None:
    nominal = {**RESONATOR, "stiffness": estimate((2.0 * math.pi * 15.0) ** 2, "1/s^2", 100.0)}
    found = derive_oscillator({"": nominal}, UNITS, 1.0, 0.05)
    assert {"natural frequency", "static deflection per drive"} <= {one.name for one in found}


def test_an_interval_is_that_of_the_linearised_function() -> None:
    (product,) = derive("p", "1", lambda a, b: a * b**2, estimate(3.0, "1", 0.03), estimate(2.0, "1", 0.1))
    assert product.high - product.value == pytest.approx(math.hypot(4.0 * 0.03, 12.0 * 0.1))
    assert derive("p", "1", lambda a: 1.0 / a, estimate(0.0, "1")) == []
    assert derive("p", "1", lambda a: a, None) == []


@pytest.mark.parametrize(("k3", "spring"), [(900.0, "hardening spring"), (-900.0, "softening spring")])
def test_a_cubic_spring_that_matters_is_told_where_it_equals_the_linear_one(k3: float, spring: str) -> None:
    """Of a beam: k = 69657 1/s^2, k3 z^2 = k at 8.8 um."""
    beam = {
        "stiffness": estimate(69657.0, "1/s^2", 10.0),
        "stiffness_cubic": estimate(k3, "1/(um^2*s^2)", 9.0),
    }
    units = {"drive": "V", "displacement": "mm"}
    found = [one for one in derive_oscillator({"": beam}, units, 0.0211) if spring in one.name]
    where, share = found
    assert where.name == f"{spring}: cubic force equals linear force at"
    assert (where.value, where.unit) == (pytest.approx(1e-3 * math.sqrt(69657.0 / 900.0)), "mm")
    assert share.name == f"{spring}: at the largest displacement, 21.1 um, cubic over linear force"
    assert share.value == pytest.approx(k3 * 21.1**2 / 69657.0)
    assert share.high - share.value == pytest.approx(0.01 * abs(share.value), rel=1e-3)


@pytest.mark.parametrize(
    ("k3", "half", "largest"),
    [(0.5, 0.01, 21.1), (900.0, 1000.0, 21.1), (900.0, 9.0, 0.5), (900.0, 0.0, 21.1), (900.0, 9.0, 0.0)],
    ids=["weak", "within its interval", "small motion", "no interval", "motion not known"],
)
def test_a_cubic_spring_that_does_not_matter_is_not_told(k3: float, half: float, largest: float) -> None:
    beam = {"stiffness": estimate(69657.0, "1/s^2"), "stiffness_cubic": estimate(k3, "1/(um^2*s^2)", half)}
    units = {"drive": "V", "displacement": "um"}
    assert not [one for one in derive_oscillator({"": beam}, units, largest) if "spring" in one.name]


def test_the_cubic_force_is_the_sum_of_the_nominal_term_and_the_cause() -> None:
    beam = {"stiffness": estimate(100.0, "1/s^2"), "stiffness_cubic": estimate(3.0, "1/(mm^2*s^2)", 0.1)}
    more = {"stiffness.cubic": {"coefficient": estimate(1.0, "1/(mm^2*s^2)", 0.1)}}
    found = derive_oscillator({"": beam, **more}, {"drive": "N", "displacement": "mm"}, 10.0)
    assert found[-2].value == pytest.approx(5.0)
