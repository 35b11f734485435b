"""Simulated instruments understand what the manuals write: long and short headers, optional parts, several units."""

from __future__ import annotations

import asyncio
import socket

import pytest
from scpi_cases import SlowDevice, instrument_at

from plant_sim.wire.scpi.grammar import header_pattern, units_of
from plant_sim.wire.scpi.models import keithley_2400, keithley_2600
from plant_sim.wire.scpi.voltmeter import voltmeter

LEVEL = ":SOURce[1]:CURRent[:LEVel][:IMMediate][:AMPLitude]"


@pytest.mark.parametrize(
    ("header", "fits"),
    [
        (":SOUR:CURR", True),
        ("SOURCE1:CURRENT:LEVEL:IMMEDIATE:AMPLITUDE", True),
        (":sour:current:lev", True),
        (":SOURC:CURR", False),
        (":SOUR2:CURR", False),
        (":SOUR:CURR:RANG", False),
        (":CURR", False),
    ],
)
def test_a_header_has_a_long_and_a_short_form(header: str, fits: bool) -> None:
    assert (header_pattern(LEVEL).fullmatch(header) is not None) is fits


def test_a_message_has_units_that_share_a_path() -> None:
    units = units_of(":SENS:FUNC 'VOLT;1';:SENS:VOLT:NPLC 0.1;RANG?;*OPC?")
    assert [(unit.header, unit.is_query, unit.parameters) for unit in units] == [
        (":SENS:FUNC", False, ("'VOLT;1'",)),
        (":SENS:VOLT:NPLC", False, ("0.1",)),
        (":SENS:VOLT:RANG", True, ()),
        ("*OPC", True, ()),
    ]


def conversation(instrument, *messages: str) -> list[str]:
    async def talk() -> list[str]:
        return [await instrument.answer(message) for message in messages]

    return asyncio.run(talk())


def test_a_source_meter_refuses_by_its_error_queue() -> None:
    device = SlowDevice()
    said = conversation(
        keithley_2400(device),
        ":SOUR:CURR:RANG 10e-3", ":SOUR:CURR 11e-3", ":SOUR:FUNC VOLT", ":WHAT 1", ":READ?", ":SOUR:CURR?",
        *5 * [":SYST:ERR?"],
    )  # fmt: skip
    assert said[:5] == ["", "", "", "", ""], "a refused question has no answer"
    assert float(said[5]) == 0.0
    assert [text.split(",")[0] for text in said[6:]] == ["-222", "-221", "-113", "+803", "+0"]


def test_an_overflow_is_the_number_of_the_standard_and_compliance_a_bit() -> None:
    device = SlowDevice()
    said = conversation(
        keithley_2400(device),
        ":SENS:VOLT:NPLC 0.01", ":SENS:VOLT:RANG 2", ":SOUR:CURR 3.68E-3", ":OUTP ON", ":READ?",
        ":SENS:VOLT:PROT 2.05", ":READ?",
    )  # fmt: skip
    overflow, limited = (text.split(",") for text in said if text)
    assert float(overflow[0]) == 9.9e37
    assert not int(float(overflow[-1])) & 8
    assert float(limited[0]) == pytest.approx(2.05)
    assert float(limited[1]) < 3.68e-3
    assert int(float(limited[-1])) & 8


def test_a_line_of_tsp_may_have_several_statements() -> None:
    device = SlowDevice()
    said = conversation(
        keithley_2600(device),
        "smua.measure.nplc=0.01 smua.source.leveli = 4e-3; smua.source.output=smua.OUTPUT_ON",
        "print(smua.source.leveli, smua.source.output, smua.nothing)",
        "format.asciiprecision=10 print(smua.measure.v(), " "status.measurement.instrument.smua.condition)",
        "smua.source.leveli=2", "for i=1,2 do end", *3 * ["print(errorqueue.next())"],
    )  # fmt: skip
    assert said[1] == "4.00000e-03\t1.00000e+00\tnil"
    volts, condition = said[2].split("\t")
    assert float(volts) == pytest.approx(4e-3 * device.read().sensed[0], rel=0.02)
    assert float(condition) == 0.0
    assert [text.split("\t")[0] for text in said[5:]] == ["-2.22000e+02", "-2.85000e+02", "0.00000e+00"]


@pytest.mark.wire
def test_what_a_host_sent_before_it_went_is_done() -> None:
    device = SlowDevice()
    with instrument_at(device, "keithley-2450") as place:
        host, _, port = place.rpartition(":")
        with socket.create_connection((host, int(port))) as client:
            client.sendall(b":SENS:VOLT:NPLC 0.5\n:SOUR:CURR 4E-3\n:OUTP ON\n:READ?\n:OUTP OFF\n")
        assert device.has_enough.wait(5.0)
        assert device.went_off.wait(5.0)
    assert not device.enabled


def test_the_voltmeter_reads_the_external_instrument() -> None:
    device = SlowDevice()
    said = conversation(voltmeter(device), ":CONF:VOLT:DC", ":VOLT:NPLC 0.02", ":READ?", ":SYST:ERR?")
    assert float(said[2]) == pytest.approx(0.1 * device.read().reference, abs=0.05)
    assert said[3] == '+0,"No error"'
