"""Drivers of others command our simulated instruments, and the simulations of others know our commands.

Skipped where PyVISA, PyMeasure or QCoDeS are not installed.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from scpi_cases import SlowDevice, driver_at, instrument_at

from drivers.scpi.instrument import filled
from drivers.scpi.ports import visa_place
from drivers.scpi.table import load_table
from rtctl.border.errors import DriverError, Fault

pytestmark = [pytest.mark.wire, pytest.mark.filterwarnings("ignore")]
LEVEL_A = 4e-3


def imported(name: str) -> Any:
    """A module of others, whose own warnings are not ours."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip(name, exc_type=ImportError)


def resource(place: str) -> str:
    host, _, port = place.rpartition(":")
    return f"TCPIP0::{host}::{port}::SOCKET"


@pytest.fixture
def device() -> SlowDevice:
    return SlowDevice()


def agrees(device: SlowDevice, ohm: float) -> bool:
    """Whether a resistance is one that the device has read since it was switched on."""
    measured = [entry.values[0] for entry in device.journal() if entry.event == "reading"]
    return any(abs(ohm / value - 1.0) < 1e-5 for value in measured)


@pytest.mark.parametrize("table", ["keithley-2400", "keithley-2600"])
def test_our_driver_over_visa(table: str, device: SlowDevice) -> None:
    imported("pyvisa_py")
    with instrument_at(device, table) as place:
        driver = driver_at(visa_place(resource(place), "@py"), table)
        first = driver.open(lockstep_period_us=None, watchdog_ms=0, timeout_s=1.0)
        assert agrees(device, first.sensed[0])
        assert agrees(device, driver.exchange((5.0,)).sensed[0])
        driver.close((3.68,))
        assert device.went_off.wait(5.0)


def test_pymeasure_commands_the_2400(device: SlowDevice) -> None:
    imported("pyvisa_py")
    keithley = imported("pymeasure.instruments.keithley")
    with instrument_at(device, "keithley-2400") as place:
        meter = keithley.Keithley2400(
            resource(place), visa_library="@py", read_termination="\n", write_termination="\n"
        )
        meter.source_mode = "current"
        meter.source_current_range = 1e-2
        meter.compliance_voltage = 20.0
        meter.source_current = LEVEL_A
        meter.voltage_nplc = 0.02
        meter.source_enabled = True
        volts, amperes, *_ = meter.values(":READ?")
        assert amperes == LEVEL_A
        assert agrees(device, volts / amperes)
        assert meter.check_errors() == []
        meter.source_enabled = False
        assert device.went_off.wait(5.0)
        meter.adapter.close()


def test_pymeasure_commands_the_2600(device: SlowDevice) -> None:
    imported("pyvisa_py")
    keithley = imported("pymeasure.instruments.keithley")
    with instrument_at(device, "keithley-2600") as place:
        meter = keithley.Keithley2600(
            resource(place), visa_library="@py", read_termination="\n", write_termination="\n"
        )
        channel = meter.ChA
        channel.source_mode = "current"
        channel.source_current_range = 1e-2
        channel.compliance_voltage = 20.0
        channel.source_current = LEVEL_A
        channel.source_output = "ON"
        assert agrees(device, channel.voltage / LEVEL_A)
        assert channel.source_current == LEVEL_A
        channel.source_output = "OFF"
        assert device.went_off.wait(5.0)
        assert meter.next_error[0] == 0
        meter.adapter.close()


@pytest.fixture
def qcodes_drivers() -> Iterator[Any]:
    imported("pyvisa_py")
    drivers = imported("qcodes.instrument_drivers")
    yield drivers
    imported("qcodes.instrument").Instrument.close_all()


@pytest.mark.usefixtures("qcodes_drivers")
def test_qcodes_commands_the_2450(device: SlowDevice) -> None:
    keithley = imported("qcodes.instrument_drivers.Keithley")
    with instrument_at(device, "keithley-2450") as place:
        meter = keithley.Keithley2450("smu", resource(place), visalib="@py")
        meter.sense_function("voltage")
        meter.source_function("current")
        meter.source.limit(20.0)
        meter.source.range(0.01)
        meter.sense.nplc(0.02)
        meter.source.current(LEVEL_A)
        meter.output_enabled(True)
        assert agrees(device, meter.sense.voltage() / LEVEL_A)
        assert meter.source.limit_tripped() is False
        assert meter.source.limit() == 20.0
        meter.output_enabled(False)
        assert device.went_off.wait(5.0)


@pytest.mark.usefixtures("qcodes_drivers")
def test_qcodes_commands_the_2400_the_2600_and_the_b2900(device: SlowDevice) -> None:
    keithley, keysight = (
        imported(f"qcodes.instrument_drivers.{maker}") for maker in ("Keithley", "Keysight")
    )
    with instrument_at(device, "keithley-2400") as place:
        meter = keithley.Keithley2400("k2400", resource(place), visalib="@py")
        meter.mode("CURR")
        meter.compliancev(20.0)
        meter.rangei(0.01)
        meter.nplcv(0.02)
        meter.curr(LEVEL_A)
        meter.output(True)
        assert agrees(device, meter.resistance())
        meter.output(False)
        assert device.went_off.wait(5.0)
    with instrument_at(device, "keithley-2600") as place:
        channel = keithley.Keithley2602B("k2602", resource(place), visalib="@py").smua
        channel.mode("current")
        channel.limitv(20.0)
        channel.sourcerange_i(0.01)
        channel.nplc(0.02)
        channel.curr(LEVEL_A)
        channel.output(True)
        assert agrees(device, channel.volt() / LEVEL_A)
        channel.limitv(2.0)
        channel.volt()
        assert channel.volt.measurement_status == "Reached voltage compliance limit."
        channel.output(False)
        assert device.went_off.wait(5.0)
    with instrument_at(device, "keysight-b2900") as place:
        channel = keysight.KeysightB2962A("b2962", resource(place), visalib="@py").ch1
        channel.source_mode("current")
        channel.voltage_limit(20.0)
        channel.source_current(LEVEL_A)
        channel.enable(True)
        assert agrees(device, channel.voltage() / LEVEL_A)
        channel.enable(False)
        assert device.went_off.wait(5.0)


@pytest.mark.parametrize(
    ("file", "table", "known"),
    [
        ("Keithley_2600.yaml", "keithley-2600",
         ("identify", "compliance_voltage", "current_range", "voltage_range", "nplc", "current", "output_on",
          "output_off", "output_state", "read")),
        ("Keithley_2450.yaml", "keithley-2450", ("identify", "output_on", "output_off", "output_state")),
    ],
)  # fmt: skip
def test_the_simulations_of_qcodes_know_our_commands(file: str, table: str, known: tuple[str, ...]) -> None:
    """Each of `known` is carried out by PyVISA-sim with QCoDeS's description, and another spelling is not."""
    imported("pyvisa_sim")
    sims = Path(imported("qcodes").__file__).parent / "instrument" / "sims"
    manager = imported("pyvisa").ResourceManager(f"{sims / file}@sim")
    there = manager.open_resource(
        "GPIB::2::INSTR", read_termination="\n", write_termination="\n", timeout=200
    )
    commands = load_table(table, Path()).commands
    has_status = "*STB?" in (sims / file).read_text(encoding="utf-8")
    for name in known:
        text = filled(getattr(commands, name), 1.0)
        if "?" in text or text.startswith("print("):
            assert "ERROR" not in there.query(text), text
        else:
            there.write(text)
            assert _understood(there, has_status), text
    there.write(str(commands.output_on).lower().replace("outp", "outq"))
    assert not _understood(there, has_status)
    manager.close()


def _understood(there: Any, has_status: bool) -> bool:
    """Whether the last command was known: where it was not, the status has a bit, or the answer is ERROR."""
    if has_status:
        return bool(there.query("*STB?").strip() == "0")
    try:
        return "ERROR" not in there.read()
    except imported("pyvisa").errors.VisaIOError:
        return True


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("nonsense", "cannot be opened: VISA: VI_ERROR_INV_RSRC_NAME .*; are resource and library right"),
        ("TCPIP0::127.0.0.1::1::SOCKET", "nothing listens there|cannot be opened: VISA"),
    ],
)
def test_a_resource_that_cannot_be_opened_is_one_message(name: str, words: str) -> None:
    imported("pyvisa_py")
    with pytest.raises(DriverError, match=words) as caught:
        driver_at(visa_place(name, "@py")).open(lockstep_period_us=None, watchdog_ms=0, timeout_s=1.0)
    assert caught.value.fault is Fault.CONNECTION_LOST
    assert "\n" not in str(caught.value)
