"""What names of columns say, in several habits and languages: quantity and unit, or nothing."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.measured.proposal.causality import leads
from rtctl.measured.proposal.naming.column_units import read_column
from rtctl.measured.proposal.survey import Column


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [
        ("Drive [V]", "drive", "V"),
        ("V_in", "drive", ""),
        ("exc", "drive", ""),
        ("F/N", "drive", "N"),
        ("Kanal 1: Kraft [N]", "drive", "N"),
        ("Spannung U in V", "drive", "V"),
        ("base acc [g]", "drive", "g_0"),
        ("Output voltage [V]", "response", "V"),
        ("disp_mm", "displacement", "mm"),
        ("Weg in mm", "displacement", "mm"),
        ("x [V]", "displacement", "V"),
        ("u [mm]", "displacement", "mm"),
        ("phi [deg]", "displacement", "deg"),
        ("position_m", "displacement", "m"),
        ("vel_mm_s", "velocity", "mm/s"),
        ("v [m/s]", "velocity", "m/s"),
        ("v [V]", "drive", "V"),
        ("omega [rad/s]", "velocity", "rad/s"),
        ("acc (g)", "acceleration", "g_0"),
        ("acc_ms2", "acceleration", "m/s^2"),
        ("a / m/s^2", "acceleration", "m/s^2"),
        ("Acc 12:+Z", "acceleration", ""),
        ("I_mA", "current", "mA"),
        ("current_ma", "current", "mA"),
        ("R_ohm", "resistance", "ohm"),
        ("Resistance (kOhm)", "resistance", "kohm"),
        ("defl_um", "deflection", "um"),
        ("t_s", "time", "s"),
        ("Zeit [ms]", "time", "ms"),
        ("X_Value", "time", ""),
        ("f [Hz]", "none", "Hz"),
        ("temp [degC]", "none", "degC"),
        ("x_m", "displacement", ""),
        ("heater_W", "", "W"),
        ("supply_mbar", "drive", "mbar"),
        ("A1", "", ""),
        ("weight_g", "", ""),
        ("mass [g]", "", ""),
    ],
)
def test_a_name_tells_quantity_and_unit(name: str, quantity: str, unit: str) -> None:
    reading = read_column(Column(name=name))
    assert reading.unit.text == unit
    votes = reading.votes
    assert (max(votes, key=lambda one: votes[one]) if votes else "") == quantity


def test_the_unit_of_the_file_comes_before_that_of_the_name() -> None:
    assert read_column(Column(name="x_mm", unit="um")).unit.text == "um"
    assert read_column(Column(name="x [mm]", unit="none")).unit.text == "mm"


def test_what_leads_shows_of_a_cause_and_neither_of_a_tone_nor_of_strangers() -> None:
    rng = np.random.default_rng(0)
    cause = rng.normal(size=6000)
    effect = np.convolve(cause, np.exp(-0.05 * np.arange(200)) * np.sin(0.3 * np.arange(200)))[:6000]
    effect += 0.01 * effect.std() * rng.normal(size=6000)
    assert leads(cause, effect) == 1
    assert leads(effect, cause) == -1
    tone = np.sin(0.1 * np.arange(6000))
    assert leads(tone, np.roll(tone, 7)) == 0
    strangers = [leads(rng.normal(size=6000), rng.normal(size=6000)) for _ in range(20)]
    assert strangers == [0] * 20
