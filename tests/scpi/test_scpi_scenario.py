"""`[driver] kind = "scpi"` in a scenario: each mistake is one message before anything is sent."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

import pytest
from wire_cases import settings

from drivers.scpi.table import load_table
from rtctl.cli import main

ROOT = Path(__file__).resolve().parents[2]
SOUND = {
    "driver.kind": "scpi",
    "clock.mode": "live",
    "driver.table": "keithley-2450",
    "driver.address": "127.0.0.1:1",
    "driver.compliance_voltage": "20 V",
}


def said(
    capsys: pytest.CaptureFixture[str], out: Path, scenario: str = "acquire_vo2_slow", **changes: str | None
) -> str:
    keys = SOUND | {key.replace("__", "."): value for key, value in changes.items()}
    options = settings(*(f"{key}={value}" for key, value in keys.items() if value is not None))
    assert main(["acquire", scenario, "--quiet", "--out", str(out), *options]) == 2
    assert not out.exists()
    message = capsys.readouterr().err
    assert "Traceback" not in message
    return message


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"clock__mode": None}, r'needs clock.mode = "live": an instrument does not wait .*--set clock.mode=live'),
        ({"driver__address": None}, "an instrument is at one of address, port, visa; got none of them"),
        ({"driver__port": "/dev/ttyUSB0"}, "got address and port"),
        ({"driver__address": "here"}, "an address is HOST:PORT"),
        ({"driver__compliance_voltage": None}, 'key "driver.compliance_voltage" is missing'),
        ({"driver__compliance_voltage": "20 mA"}, "not compatible with V"),
        ({"driver__compliance_voltage": "300 V"}, "must be above 0 V and at most 210 V"),
        ({"driver__nplc": "10"}, r"10 power line cycles last 167 ms or more, the period is 20 ms"),
        ({"driver__nplc": "0.001"}, r"driver.nplc = 0.001 must be 0.01 to 10"),
        ({"driver__current_range": "1 mA"}, r"range = 0.001 A is less than the current of \[limits\], 0.00849 A"),
        ({"driver__current_range": "2 A"}, "sources up to 1.05 A, 2 A are asked for"),
        ({"limits__low": "0 mA"}, "without a current there is no resistance; set limits.low and limits.safe above 0"),
        ({"driver__table": "keithley-245"}, 'did you mean "keithley-2450"'),
        ({"driver__table": "voltmeter"}, "SCPI voltmeter: as a source its table needs commands.compliance_voltage"),
        ({"driver__complaince": "1"}, 'unknown key "driver.complaince"'),
        ({"driver__reference__address": "127.0.0.1:2"}, 'key "driver.reference.scale" is missing'),
        ({"driver__reference__address": "127.0.0.1:2", "driver__reference__scale": "2 V/um"}, "reference.scale: unit"),
        ({}, "connection refused, nothing listens there"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_message(
    changes: dict[str, str | None], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    message = said(capsys, tmp_path / "out", **changes)
    assert re.search(words, message), message
    assert message.strip().count("\n") == 0


def test_a_device_without_a_current_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    message = said(capsys, tmp_path / "out", "acquire_oscillator")
    assert "the device must take a current, not drive in m/s^2" in message


def test_visa_without_its_package_names_the_extra(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyvisa", None)
    message = said(capsys, tmp_path / "out", driver__address=None, driver__visa="GPIB0::24::INSTR")
    assert "driver.visa needs pyvisa: pip install 'rtctl[visa]'" in message


def test_the_tables_of_the_page_are_read(tmp_path: Path) -> None:
    page = (ROOT / "docs/instruments.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    own = next(block for block in blocks if block.startswith("[instrument]"))
    assert len(own.splitlines()) <= 22, "a table of one's own has some twenty lines"
    (tmp_path / "own.toml").write_text(own, encoding="utf-8")
    assert load_table("own.toml", tmp_path).source_commands().read == ":MEAS:RES? (@2)"
    driver = tomllib.loads(blocks[0])["driver"]
    assert load_table(driver["table"], tmp_path)
