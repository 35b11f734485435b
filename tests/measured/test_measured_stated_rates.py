"""A line above the columns of a text file states the sample rate, or it does not, or cannot be used."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from rtctl.measured.columns.conversion import TableCache
from rtctl.measured.columns.time_axis import StatedPeriod, check_stated_period, decimation
from rtctl.measured.readers import open_table
from rtctl.measured.readers.stated.preamble import NumberedLine, Preamble, read_preamble, states_rate
from rtctl.measured.readers.stated.rate import stated_period

ROWS = "".join(f"{np.sin(0.3 * k):.6f},{0.1 * k:.3f}\n" for k in range(40))


def preamble(*lines: str, decimal: str = ".") -> Preamble:
    return read_preamble([NumberedLine(k, line) for k, line in enumerate(lines, start=1)], decimal)


@pytest.mark.parametrize(
    ("line", "period_s"),
    [
        ("# Sampling rate: 2000 Hz", 5e-4),
        ("Sample Rate\t2000", 5e-4),
        ("Sample Rate:\t2000\tHz", 5e-4),
        ("fs = 2 kHz", 5e-4),
        ("FS=2e3", 5e-4),
        ('"Sample Interval",5.0e-4,s', 5e-4),
        ("% dt=0.0005", 5e-4),
        ("// dt [ms] = 0,5", 5e-4),
        ("; Abtastrate in kHz : 2,5", 4e-4),
        ("Abtastintervall;0,5;ms", 5e-4),
        ("Frecuencia de muestreo: 2000 Hz", 5e-4),
        ("Frequenza di campionamento = 2 kHz", 5e-4),
        ("Pas de temps : 0,5 ms", 5e-4),
        ("Sample rate, Hz: 2000", 5e-4),
        ("Sample Rate: 2000 Hz (nominal)", 5e-4),
        ("Sampling frequency 2 kSa/s, 16 bit", 5e-4),
        ("Samples per second: 2000", 5e-4),
        ("# sampled at 2 MHz", 5e-7),
        ("sample rate: 500 mHz", 2.0),
        ("Operator: JD | Scan rate: 2000 S/s", 5e-4),
        ("dt=0.5", 0.5),
        ("Ts = 0.5", 0.5),
        ("Sample interval: 10 min", 600.0),
        ("interval: 500 us", 5e-4),
    ],
)
def test_a_line_states_a_period(line: str, period_s: float) -> None:
    assert preamble(line).period_s == pytest.approx(period_s, rel=1e-12)
    assert preamble(line).doubt == ""


@pytest.mark.parametrize(
    "line",
    [
        "Sample count: 3000",
        "Samples per channel: 600",
        "Samples: 600",
        "Baud rate: 9600",
        "Heart rate: 70",
        "Strain rate: 0.01 1/s",
        "Feed rate: 5 mm/min",
        "Rate: 5 mm/min",
        "Patient, rate: 70",
        "Sampling date: 2026-11-21",
        "Sampling time: 10:00:00",
        "Sample time: 21.11.2026 10:00",
        "Time: 12.5",
        "Date: 2026-11-21",
        "FS: 10 V",
        "FS: 1,000 V",
        "Excitation frequency: 20 Hz",
        "Cut-off frequency: 500 Hz",
        "Sample rate divider: 4",
        "t [s],fs,x",
        "t [s],1,2",
        "f (s): 3",
        "t_s: 0.5",
        "u [V],rate [Hz]",
        "0.5,1.0e-03",
    ],
)
def test_other_numbers_are_no_rate(line: str) -> None:
    assert preamble(line) == Preamble()
    assert not states_rate(line)


@pytest.mark.parametrize(
    ("line", "decimal", "why"),
    [
        ("interval: 500", ".", "without its unit"),
        ("Delta_X\t0.001\t0.001", ".", "without its unit"),
        ("dt = 1", ".", "no unit"),
        ("Sampling time: 60 s", ".", "duration"),
        ("Sample rate: 2,000 Hz", ".", "thousands"),
        ("fs = 2,000 Hz", ".", "thousands"),
        ("Sample rate: 2.000 Hz", ",", "thousands"),
        ("Sample rate: 2 000 Hz", ".", "no rate that can be read"),
        ("Sample rate: auto", ".", "no rate that can be read"),
        ("Sample rate: 0 Hz", ".", "no rate that can be read"),
        ("Sample interval: 2000 Hz", ".", "no period that can be read"),
        ("Sample Rate,2000,500", ".", "several rates"),
        ("Sample rate: 2000 Hz, 500 Hz", ".", "several rates"),
    ],
)
def test_a_number_whose_meaning_does_not_show_is_told_and_not_used(line: str, decimal: str, why: str) -> None:
    found = preamble("bench 3", line, decimal=decimal)
    assert found.period_s is None
    assert found.doubt.startswith("line 2 ")
    assert why in found.doubt


def test_marks_of_decimals_are_clear_where_the_numbers_of_the_file_have_them() -> None:
    assert preamble("Sample rate: 2,000 kHz", decimal=",").period_s == pytest.approx(5e-4)
    assert preamble("Sample rate: 2.000 kHz", decimal=".").period_s == pytest.approx(5e-4)


def test_an_axis_of_time_gives_its_step_a_unit() -> None:
    assert preamble("X_Dimension\tTime\tTime", "Delta_X\t0.001\t0.001").period_s == 1e-3
    assert preamble("Horizontal Units,s", "Increment,0.001").period_s == 1e-3
    assert preamble("X_Dimension\tFrequency", "Delta_X\t0.001").period_s is None


def test_of_two_lines_that_agree_the_one_with_more_digits_counts_and_others_are_both_named() -> None:
    found = preamble("dt = 0.49 ms", "fs = 2048 Hz")
    assert found.period_s == 1.0 / 2048.0
    assert found.source == 'line 2 "fs = 2048 Hz"'
    found = preamble("dt = 0.49 ms", "note", "fs = 2148 Hz")
    assert found.period_s is None
    assert 'line 1 "dt = 0.49 ms" (2040.82 Hz) and line 3 "fs = 2148 Hz" (2148 Hz)' in found.doubt


def test_a_rounded_period_is_held_against_others_within_its_last_digit() -> None:
    stated = StatedPeriod(4.9e-4, "by line 1", 0.01)
    check_stated_period(stated, "x", 2048.0)
    with pytest.raises(ValueError, match="correct one"):
        check_stated_period(stated._replace(rounding=0.0), "x", 2048.0)
    with pytest.raises(ValueError, match="correct one"):
        check_stated_period(stated, "x", 2100.0)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_the_line_is_counted_as_an_editor_does(tmp_path: Path, end: str) -> None:
    path = tmp_path / "r.csv"
    path.write_bytes(f"# bench\n\n  \n# fs: 2000 Hz\na [V],b [mm]\n{ROWS}".replace("\n", end).encode())
    stated = TableCache().period_s(path, "a [V]")
    assert stated is not None
    assert stated.key == 'by line 4 "# fs: 2000 Hz"'


@pytest.mark.parametrize(
    ("head", "names"),
    [
        ("# a [V], b [mm]\n", ["a [V]", "b [mm]"]),
        ("# a [V]; b [mm]\n", ["a [V]", "b [mm]"]),
        ("# a [V]\tb [mm]\n", ["a [V]", "b [mm]"]),
        ("# a [V]  b [mm]\n", ["a [V]", "b [mm]"]),
        ("# a, b\n# fs = 2 kHz\n", ["a", "b"]),
        ("# 3, 4\n", ["column_1", "column_2"]),
    ],
)
@pytest.mark.parametrize("separator", [" ", "\t", ",", ";"])
def test_a_comment_names_columns_by_any_separator(
    tmp_path: Path, head: str, names: list[str], separator: str
) -> None:
    path = tmp_path / "r.csv"
    path.write_text(head + ROWS.replace(",", separator))
    assert list(open_table(path).columns) == names


def test_words_in_a_comment_are_no_names_of_columns_that_no_blanks_separate(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_text(f"# dry sand\n{ROWS}")
    assert list(open_table(path).columns) == ["column_1", "column_2"]


def test_a_line_between_names_and_older_notes_is_their_border(tmp_path: Path) -> None:
    """`a` and `b` are units too: those of the line above, if the rate did not stand between."""
    path = tmp_path / "r.csv"
    path.write_text(f"Date,2026-11-21\nRate,1000\na,b\n{ROWS}")
    assert list(open_table(path).columns) == ["a", "b"]


def test_a_line_of_very_many_cells_is_looked_at_where_it_begins() -> None:
    """Each place in it could be the beginning of a key and of a value."""
    assert states_rate("fs = 2000 Hz;" + 20 * "note;")
    assert not states_rate(1000 * "note;" + "fs = 2000 Hz")


def test_attributes_know_the_same_words(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "r.h5", "w") as file:
        file.attrs["Abtastintervall"] = "0,5 ms"
        assert stated_period(dict(file.attrs)) == (pytest.approx(5e-4), 'by "Abtastintervall"')
    assert stated_period({"fs_mHz": 500.0}) == (2.0, 'by "fs_mHz"')
    assert stated_period({"timestep": 120}) is None
    assert stated_period({"rate": 5.0}) is None


@pytest.mark.parametrize(
    ("rate_hz", "every"),
    [(500.0, 4), (2000.0 / 7.0, 7), (1999.0, 0), (1500.0, 0), (2.0, 0), (2000.0 / 60.0, 0)],
)
def test_a_file_may_have_one_of_several_samples_of_a_device_and_a_mistaken_unit_is_no_such_thing(
    rate_hz: float, every: int
) -> None:
    assert decimation(StatedPeriod(5e-4, "line 1", is_of_device=True), rate_hz) == every
    assert decimation(StatedPeriod(5e-4, "wf_increment"), rate_hz) == 0
