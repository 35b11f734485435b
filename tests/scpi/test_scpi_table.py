"""Tables of instruments: those that come with the program are whole, and each mistake in one's own is one message."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivers.scpi.table import NEEDED, bundled_tables, load_table
from rtctl.border.errors import InputError

OWN = """
[instrument]
name = "Acme 1"
identity = "ACME,MODEL 1*"
[commands]
read = "READ?"
{more}
[answer]
fields = {fields}
"""


def own(tmp_path: Path, more: str = "", fields: str = '["voltage"]') -> str:
    path = tmp_path / "acme.toml"
    path.write_text(OWN.format(more=more, fields=fields), encoding="utf-8")
    return str(path)


def test_the_tables_that_come_with_the_program_are_whole() -> None:
    tables = {name: load_table(name, Path()) for name in bundled_tables()}
    assert {"keithley-2400", "keithley-2450", "keithley-2600", "keysight-b2900", "voltmeter"} == tables.keys()
    for name, table in tables.items():
        assert table.commands.next_error, name
        if name != "voltmeter":
            assert table.source_commands().current
            assert table.commands.nplc
            assert table.answer.compliance_bits


@pytest.mark.parametrize(
    ("table", "identity", "fits"),
    [
        ("keithley-2400", "KEITHLEY INSTRUMENTS INC.,MODEL 2400,1234567,C34 Mar 31 2015/A02", True),
        ("keithley-2400", "KEITHLEY INSTRUMENTS INC.,MODEL 2000,1234567,A20", False),
        ("keithley-2450", "KEITHLEY INSTRUMENTS,MODEL 2450,04612398,1.7.12b", True),
        ("keithley-2450", "KEITHLEY INSTRUMENTS INC.,MODEL 2400,1234567,C34", False),
        ("keithley-2600", "Keithley Instruments Inc., Model 2612B, 1398687, 3.0.0", True),
        ("keysight-b2900", "Keysight Technologies,B2901B,MY61390641,5.2", True),
        ("keysight-b2900", "Agilent Technologies,B2912A,MY51141059,1.2", True),
        ("keysight-b2900", "Keysight Technologies,34465A,MY1,A.02", False),
    ],
)
def test_identities_of_real_instruments(table: str, identity: str, fits: bool) -> None:
    assert load_table(table, Path()).fits(identity) is fits


@pytest.mark.parametrize(
    ("more", "fields", "words"),
    [
        ('curent = "CURR {value}"', '["voltage"]', 'unknown key "commands.curent"; did you mean "current"'),
        ('current = "CURR"', '["voltage"]', r'key "commands.current": must have \{value\} once'),
        ('current = "CURR {value} {unit}"', '["voltage"]', "must have"),
        ('setup = ["A\\nB"]', '["voltage"]', "one line of printable ASCII"),
        ("", '["volts"]', "unknown value 'volts'; known: voltage"),
        ("", '["status"]', "fields names no reading"),
        ("", '["voltage", "voltage"]', "names one twice: voltage, voltage"),
        ("", '["voltage"]\ncompliance_bits = 8', "compliance_bits needs status"),
    ],
)
def test_a_mistake_in_a_table_is_one_message(tmp_path: Path, more: str, fields: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        load_table(own(tmp_path, more, fields), Path())
    assert "acme.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_meter_is_no_source(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=f"^Acme 1: as a source its table needs commands.{NEEDED[0]}$"):
        load_table(own(tmp_path), Path()).source_commands()


def test_an_unknown_table_names_the_nearest(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r'driver.table = "keithley-24": no bundled table; did you mean "keithley-24.0"'
    ):
        load_table("keithley-24", tmp_path)
    with pytest.raises(InputError, match=r'"mine\.toml": no such file'):
        load_table("mine.toml", tmp_path)


def test_a_table_lies_beside_the_scenario(tmp_path: Path) -> None:
    own(tmp_path)
    assert load_table("acme.toml", tmp_path).instrument.name == "Acme 1"
