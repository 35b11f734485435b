"""Answers of instruments as numbers, as the manuals and the drivers of others show them."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivers.scpi.answers import error_of, is_off, reading_of
from drivers.scpi.table import load_table
from rtctl.border.errors import DriverError, Fault


@pytest.mark.parametrize(
    ("table", "text", "values"),
    [
        ("keithley-2400", "+1.000206E+00,+1.000000E-04,+34816", (1.000206, 1e-4, False)),
        ("keithley-2400", "+2.1E+01,+1.000000E-04,+34824", (21.0, 1e-4, True)),
        ("keithley-2450", "2.5E+00,5.0E-03,128", (2.5, 5e-3, False)),
        ("keithley-2450", "2.5E+00,5.0E-03,160", (2.5, 5e-3, True)),
        ("keithley-2600", "1.2345678901e+00\t0.000000000e+00", (1.2345678901, None, False)),
        ("keithley-2600", "1.2345678901e+00\t1.000000000e+00", (1.2345678901, None, True)),
        ("keysight-b2900", "+1.000000E+00,+5.000000E-03,+1.000000E+00", (1.0, 5e-3, False)),
        ("keysight-b2900", "+9.900000E+37,+5.000000E-03,+3.000000E+00", (9.9e37, 5e-3, True)),
    ],
)
def test_a_reading(table: str, text: str, values: tuple[float, float | None, bool]) -> None:
    reading = reading_of(text, load_table(table, Path()).answer)
    assert (reading.voltage_V, reading.current_A, reading.limited) == values
    assert reading.resistance_ohm is None


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("+9.9E+37,0,0", Fault.OUT_OF_RANGE),
        ("-9.9E37,0,0", Fault.OUT_OF_RANGE),
        ("9.90000009E+37,0,0", Fault.OUT_OF_RANGE),
        ("inf,0,0", Fault.OUT_OF_RANGE),
        ("9.91E37,0,0", Fault.NOT_FINITE),
        ("nan,0,0", Fault.NO_ANSWER),
        ("1,0,inf", Fault.NO_ANSWER),
        ("", Fault.NO_ANSWER),
        ("1,2,3,4", Fault.NO_ANSWER),
        ("1,2,", Fault.NO_ANSWER),
    ],
)
def test_what_is_no_reading_is_a_fault(text: str, fault: Fault) -> None:
    with pytest.raises(DriverError) as caught:
        reading_of(text, load_table("keithley-2400", Path()).answer)
    assert caught.value.fault is fault


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('0,"No error"', ""),
        ('+0,"No error"', ""),
        ('0,"No error;0;0 0"', ""),
        ('-113,"Undefined header"', "-113 Undefined header"),
        ('+803,"Not permitted with OUTPUT off"', "803 Not permitted with OUTPUT off"),
        ("0.00000e+00\tQueue Is Empty\t0.00000e+00\t1.00000e+00", ""),
        (
            "-2.85000e+02\tTSP Syntax error at line 1\t2.00000e+01\t1.00000e+00",
            "-285 TSP Syntax error at line 1",
        ),
    ],
)
def test_an_entry_of_an_error_queue(text: str, said: str) -> None:
    assert error_of(text) == said


@pytest.mark.parametrize("text", ["KEITHLEY", "", "nan", 'inf,"much"'])
def test_what_is_no_entry_is_a_fault(text: str) -> None:
    with pytest.raises(DriverError, match="which begins with no number"):
        error_of(text)


@pytest.mark.parametrize(
    ("text", "off"), [("0", True), ("0.00000e+00", True), ("OFF", True), ("1", False), ("", False)]
)
def test_the_output_is_off(text: str, off: bool) -> None:
    assert is_off(text) is off
