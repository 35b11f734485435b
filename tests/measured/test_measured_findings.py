"""Every way in which a manifest or its files can be wrong has one message that says what to do."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rtctl.border.errors import InputError
from rtctl.measured import open_dataset, read_dataset

Write = Callable[..., Path]
Change = tuple[str, str]
RATE = "sample_rate_hz = 1000.0"


def message_of(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_dataset(path)
    text = str(caught.value)
    assert all(line.startswith(f"{path}: ") for line in text.splitlines()), "every finding names the manifest"
    return text.replace(f"{path}: ", "")


def test_what_is_known_is_listed_once(oscillator: Write) -> None:
    text = message_of(oscillator(('role = "input"', 'role = "input"\nhold = "sideways"')))
    assert text.endswith("'sideways' is not one of linear, zero, band-limited")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ((RATE, RATE + "\nignore_frist = 3"), '"records.0.ignore_frist"; did you mean "ignore_first"?'),
        (('unit = "mm"', 'unit = "mm"\nhodl = "zero"'), '"signals.displacement.hodl"; did you mean "hold"?'),
        (('name = "shaker run 7"', ""), 'key "dataset.name" is missing'),
        (('"oscillator"', '"oscilator"'), "'oscilator' is not one of oscillator, vo2, equations, fmu; did"),
        (('role = "input"', 'role = "inptu"'), "'inptu' is not one of input, output; did you mean"),
        (('role = "input"', 'role = "output"'), 'key "signals.drive.role": "drive" of a plant'),
        (('role = "input"', 'role = "input"\nhold = "zoh"'), "'zoh' is not one of linear, zero"),
        (('unit = "mm"', 'unit = "mm"\nhold = "zero"'), 'hold = "zero" is for inputs only; remove it'),
        ((RATE, RATE + '\nuse = "tset"'), "'tset' is not one of identify, fit, test; did you mean"),
        (('unit = "mm"', 'unit = "milimeter"'), 'key "signals.displacement.unit": unknown unit "milimeter"'),
        (('unit = "mm"', 'unit = "m/s^^2"'), 'unit "m/s^^2" cannot be read'),
        (('unit = "mm"', 'unit = "mm)"'), 'unit "mm)" cannot be read'),
        (("[signals.drive]", "[signals.dirve]"), 'plant "oscillator"; did you mean "drive"'),
        (("[signals.drive]", "[signals.dirve]"), 'signal "drive" is missing: a plant "oscillator" needs'),
        ((RATE, ""), "no sample rate: add sample_rate_hz = <Hz>, or time = <column in seconds>"),
        ((RATE, RATE + '\ntime = "t"'), 'sample_rate_hz = 1000 and time = "t" exclude each other; keep one'),
        ((RATE, RATE + "\nresample = true"), "resample = true needs a time column"),
        ((RATE, RATE + '\nresample = "maybe"'), 'key "records.0.resample"'),
        ((RATE, "sample_rate_hz = -5.0"), 'key "records.0.sample_rate_hz": -5.0 is not a rate; write a number of'),
        ((RATE, "sample_rate_hz = 0"), "0 is not a rate; write a number of Hz above 0, such as 1000.0"),
        ((RATE, "sample_rate_hz = nan"), "nan is not a rate"),
        ((RATE, "sample_rate_hz = inf"), "inf is not a rate"),
        ((RATE, "sample_rate_hz = true"), "True is not a rate"),
        ((RATE, 'sample_rate_hz = "1 kHz"'), "'1 kHz' is not a rate; write a number of Hz"),
        ((RATE, "time = 3"), 'key "records.0.time": 3 is not a text; write one in quotes'),
        ((RATE, RATE + "\nrows = [50, 50]"), 'rows": [50, 50] selects nothing; the first must be below'),
        ((RATE, RATE + "\nrows = [-1, 50]"), 'rows": -1 is not a whole number from 0 on'),
        ((RATE, RATE + "\nrows = [0, 1.5]"), 'rows": 1.5 is not a whole number from 0 on'),
        ((RATE, RATE + "\nrows = [50]"), 'rows": [50] is not [first, end], the first row and the one after'),
        ((RATE, RATE + "\nrows = 50"), 'rows": 50 is not [first, end]'),
        ((RATE, RATE + "\nignore_first = -1"), 'ignore_first": -1 is not a whole number from 0 on'),
        ((RATE, RATE + "\nrepeat = 3"), 'repeat": 3 is not a text; write one in quotes'),
        ((RATE, RATE + "\nconditions = 3"), 'conditions": 3 is not a table; write { name = value }'),
        ((RATE, RATE + "\ninitial = 3"), 'initial": 3 is not a table; write { name = value }'),
        ((RATE, RATE + "\nrows = [50, 201]"), "rows = [50, 201] ends after the file's 200 rows"),
        ((RATE, RATE + "\nrows = [50, 51]"), "a record needs at least 2 samples, got 1"),
        ((RATE, RATE + "\nignore_first = 200"), "ignore_first = 200 leaves nothing of 200 samples"),
        (('"r00.csv"', '"r0.csv"'), 'no such file'),
        (('"r00.csv"', '"r0.csv"'), 'did you mean "r00.csv"?'),
        (('"r00.csv"', '"r00.xlsx"'), '".xlsx"; known: .arrow, .asc, .csv, .csv.gz, .dat, .feather, .h5, .hdf5'),
        (('"x_tip"', '"x_tpi"'), 'no column "x_tpi"; did you mean "x_tip"?'),
        ((RATE, 'time = "t"'), 'no column "t"'),
        ((RATE, RATE + "\ninitial = { dispalcement = 1.0 }"), 'unknown key "initial.dispalcement"'),
        ((RATE, RATE + '\ninitial = { velocity = "1 V" }'), 'unit "V" is not compatible with mm/s'),
        ((RATE, RATE + "\ninitial = { velocity = nan }"), "must be finite, got nan mm/s"),
        ((RATE, RATE + "\ninitial = { velocity = true }"), "key initial.velocity: a quantity with its unit"),
        ((RATE, RATE + '\ninitial = { velocity = "fast" }'), "a quantity is \"<number> <unit>\", such as"),
        ((RATE, RATE + '\nname = "a/b"'), "key \"records.0.name\": 'a/b' is not a name without / and"),
        ((RATE, RATE + '\nname = ""'), "key \"records.0.name\": '' is not a name"),
        (('unit = "mm"', ""), 'key "signals.displacement.unit" is missing'),
        (('unit = "mm"', "unit = 3"), 'key "signals.displacement.unit": 3 is not a unit; write one in quotes'),
        (('unit = "mm"', 'unit = ""'), "'' is not a unit; write one in quotes (\"dimensionless\" for a"),
        (('unit = "mm"', 'unit = "2 mm"'), 'unit "2 mm" cannot be read'),
        (('role = "input"', ""), 'key "signals.drive.role" is missing'),
        (('file = "r00.csv"', ""), 'key "records.0.file" is missing'),
        (('"r00.csv"', '""'), "key \"records.0.file\": '' is not a text"),
        (('"r00.csv"', '"r00"'), 'no reader for the suffix ""; known: .arrow'),
        (('"shaker run 7"', '""'), "key \"dataset.name\": '' is not a text"),
        (('"x_tip"', '"drive"'), '"drive" and "displacement" both read the column "drive"; correct one'),
    ],
)  # fmt: skip
def test_a_wrong_manifest_is_told_in_one_message(oscillator: Write, change: Change, message: str) -> None:
    assert message in message_of(oscillator(change))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('unit = "A"', 'unit = "V"'), 'key "signals.current.unit": unit "V" is not compatible with mA'),
        (('unit = "kohm"', 'unit = "kg"'), 'resistance.unit": unit "kg" is not compatible with ohm'),
        (('unit = "mm"', 'unit = "s"'), 'deflection.unit": unit "s" is not compatible with um'),
        (("[signals.resistance]", "[signals.drive]"), 'signal "resistance" is missing: a plant "vo2" needs'),
        (("[signals.current]", "[signals.velocity]"), 'with role = "input" and its unit in mA'),
        ((RATE, RATE + "\ninitial = { current = 4.0 }"), "starts on the branch that a full cooling leaves"),
        (('unit = "mm"', 'unit = "mm"\ncolumn = "defelction"'), 'did you mean "deflection"?; correct column'),
    ],
)  # fmt: skip
def test_a_wrong_vo2_manifest_is_told_in_one_message(vo2: Write, change: Change, message: str) -> None:
    assert message in message_of(vo2(change))


@pytest.mark.parametrize("read", [read_dataset, open_dataset])
@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        (
            {"x_tip": np.zeros((9, 2))},
            'column "x_tip" has shape (9, 2), one dimension is needed; save one array',
        ),
        ({"x_tip": 1j * np.ones(9)}, 'column "x_tip" holds complex128, real numbers are needed'),
        ({"x_tip": np.array([None] * 9)}, 'column "x_tip" holds Python objects, numbers are needed'),
        ({"x_tip": np.zeros(0), "drive": np.zeros(0)}, "the file has no rows"),
        ({"x_tip": np.zeros(1), "drive": np.zeros(1)}, "a record needs at least 2 samples, got 1"),
        ({"x_tip": np.zeros(8)}, "columns differ in length: drive 9, displacement 8"),
        ({"x_tpi": np.zeros(9)}, 'no column "x_tip"; did you mean "x_tpi"?'),
    ],
)
def test_arrays_that_are_no_record_are_told_before_their_numbers_are_read(
    oscillator: Write,
    tmp_path: Path,
    read: Callable[[Path], object],
    arrays: dict[str, np.ndarray],
    message: str,
) -> None:
    path = oscillator(('"r00.csv"', '"r00.npz"'))
    np.savez(tmp_path / "r00.npz", **{"drive": np.zeros(9), **arrays})
    with pytest.raises(InputError) as caught:
        read(path)
    assert f'{path}: records.0 "r00.npz": {message}' in str(caught.value)


def test_a_velocity_that_is_nowhere_a_number(oscillator: Write) -> None:
    table = ("[[records]]", '[signals.velocity]\nrole = "output"\nunit = "mm/s"\n[[records]]')
    assert message_of(oscillator(table)) == (
        'signals.velocity: column "velocity" is in no file; known: drive, x_tip; '
        "correct column, or remove [signals.velocity]"
    )
    text = message_of(oscillator(table, velocity=np.full(200, np.nan)))
    assert text.startswith('signals.velocity: column "velocity" is NaN throughout; correct column')


@pytest.mark.parametrize(
    ("displacement", "velocity"), [("mm", "mm"), ("V", "m/s"), ("m", "m/s^2"), ("rad", "mm/s"), ("V", "V")]
)
def test_velocity_must_be_displacement_per_second(
    oscillator: Write, displacement: str, velocity: str
) -> None:
    unit = ('unit = "mm"', f'unit = "{displacement}"')
    table = ("[[records]]", f'[signals.velocity]\nrole = "output"\nunit = "{velocity}"\n[[records]]')
    assert f'velocity.unit": unit "{velocity}" is not compatible with {displacement}/s' in message_of(
        oscillator(unit, table)
    )


def test_velocity_in_a_unit_that_is_no_rate_of_displacement(oscillator: Write) -> None:
    table = ("[[records]]", '[signals.velocity]\nrole = "output"\nunit = "V"\n[[records]]')
    assert 'unit "V" is not compatible with mm/s' in message_of(oscillator(table))


def test_no_records_at_all(oscillator: Write) -> None:
    path = oscillator()
    path.write_text(path.read_text().split("[[records]]")[0])
    assert (
        message_of(path) == "no records: add [[records]] with file and sample_rate_hz for each measured file"
    )


def test_no_signals_at_all(oscillator: Write) -> None:
    path = oscillator()
    text = path.read_text()
    path.write_text(text[: text.index("[signals.drive]")] + text[text.index("[[records]]") :])
    assert [line.split(":")[0] for line in message_of(path).splitlines()] == [
        'signal "drive" is missing',
        "no response is there",
    ]


def test_tables_of_the_wrong_kind_are_told_not_crashed_on(tmp_path: Path) -> None:
    path = tmp_path / "dataset.toml"
    path.write_text('signals = 3\nrecords = "all"\ndataset = []\n')
    assert message_of(path).count('key "') == 3


def test_text_that_is_no_toml(tmp_path: Path) -> None:
    path = tmp_path / "dataset.toml"
    path.write_text("[dataset\n")
    assert "not valid TOML" in message_of(path)


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ({17: np.nan}, 'column "x_tip" is NaN in 1 of 200 rows: row 17 (counted from 0)'),
        ({3: np.inf, 9: np.nan}, '"x_tip" is NaN or infinite in 2 of 200 rows: rows 3, 9 (counted'),
        (dict.fromkeys(range(40, 50), np.nan), "rows 40, 41, 42, 43, 44 and 5 more (counted from 0)"),
    ],
)  # fmt: skip
def test_values_that_are_not_finite_are_named_by_row(
    oscillator: Write, shaker: dict[str, np.ndarray], bad: dict[int, float], message: str
) -> None:
    values = shaker["x_tip"].copy()
    values[list(bad)] = list(bad.values())
    text = message_of(oscillator(x_tip=values))
    assert message in text
    assert "leave these rows out with rows = [first, end]" in text


def test_rows_in_messages_are_those_of_the_file_not_of_the_slice(
    oscillator: Write, shaker: dict[str, np.ndarray]
) -> None:
    values = shaker["x_tip"].copy()
    values[[5, 120]] = np.nan
    assert "row 120 (counted from 0)" in message_of(
        oscillator((RATE, RATE + "\nrows = [100, 200]"), x_tip=values)
    )


def test_a_gap_outside_the_rows_that_are_used_does_no_harm(
    oscillator: Write, shaker: dict[str, np.ndarray]
) -> None:
    values = shaker["x_tip"].copy()
    values[5] = np.nan
    read = read_dataset(oscillator((RATE, RATE + "\nrows = [100, 200]"), x_tip=values))
    assert read.records[0].samples == 100


def test_a_lost_sample_is_told_with_its_place_and_size(oscillator: Write) -> None:
    time_s = 1e-3 * (np.arange(200) + (np.arange(200) > 120))
    text = message_of(oscillator((RATE, 'time = "t"'), t=time_s))
    assert (
        "after row 120 it goes on by 0.002 s, usually 0.001 s (100 % off, allowed 0.1 %; 1 such intervals)"
        in text
    )
    assert "set resample = true" in text


def test_rows_of_a_time_column_are_those_of_the_file(oscillator: Write) -> None:
    rows = 'time = "t"\nrows = [100, 200]'
    time_s = 1e-3 * (np.arange(200) + (np.arange(200) > 120))
    assert "after row 120 it goes on" in message_of(oscillator((RATE, rows), t=time_s))
    time_s = 1e-3 * (np.arange(200) - 5 * (np.arange(200) > 130))
    assert "does not increase from row 130 (0.13 s) to 131 (0.126 s)" in message_of(
        oscillator((RATE, rows), t=time_s)
    )


def test_a_gap_in_the_time_column(oscillator: Write) -> None:
    time_s = 1e-3 * np.arange(200)
    time_s[7] = np.nan
    text = message_of(oscillator((RATE, 'time = "t"\nresample = true'), t=time_s))
    assert 'key time: column "t" is NaN in 1 of 200 rows: row 7' in text


def test_a_file_with_a_header_and_nothing_else(oscillator: Write, tmp_path: Path) -> None:
    path = oscillator()
    (tmp_path / "r00.csv").write_text("drive,x_tip\n")
    assert message_of(path) == 'records.0 "r00.csv": the file has no rows'


def test_columns_of_different_lengths(oscillator: Write, tmp_path: Path) -> None:
    path = oscillator(('"r00.csv"', '"r00.npz"'))
    np.savez(tmp_path / "r00.npz", drive=np.zeros(10), x_tip=np.zeros(9))
    assert "columns differ in length: drive 10, displacement 9" in message_of(path)


@pytest.mark.parametrize(("stretch", "uniform"), [(1.0009, True), (1.0011, False)])
def test_a_time_column_may_be_off_by_a_thousandth(oscillator: Write, stretch: float, uniform: bool) -> None:
    intervals = np.full(200, 1e-3)
    intervals[80] *= stretch
    path = oscillator((RATE, 'time = "t"'), t=np.cumsum(intervals))
    if uniform:
        assert read_dataset(path).records[0].samples == 200
    else:
        assert "(0.11 % off, allowed 0.1 %" in message_of(path)


@pytest.mark.parametrize("resample", ["", "\nresample = true"])
def test_a_time_column_must_rise(oscillator: Write, resample: str) -> None:
    time_s = 1e-3 * np.arange(200)
    time_s[60] = time_s[59]
    text = message_of(oscillator((RATE, f'time = "t"{resample}'), t=time_s))
    assert "does not increase from row 59 (0.059 s) to 60 (0.059 s); sort or correct the file" in text


def test_records_of_one_name_are_refused(oscillator: Write) -> None:
    twice = f'{RATE}\n[[records]]\nfile = "r00.csv"\n{RATE}'
    assert 'records need different names, "r00" appears twice' in message_of(oscillator((RATE, twice)))


def test_all_findings_of_a_manifest_come_at_once(oscillator: Write) -> None:
    text = message_of(
        oscillator(
            ('role = "input"', 'role = "inptu"'),
            ('unit = "mm"', 'unit = "milimeter"'),
            (RATE, RATE + "\nignore_frist = 3"),
            ("[signals.displacement]", "[signals.displacment]"),
        )
    )
    for part in ("inptu", "ignore_frist", '"signals.displacment"', "no response is there"):
        assert part in text


def test_all_findings_of_the_files_come_at_once(oscillator: Write, tmp_path: Path) -> None:
    more = f'{RATE}\n[[records]]\nfile = "gone.csv"\n{RATE}\n[[records]]\nfile = "text.csv"\n{RATE}'
    path = oscillator((RATE, more), x_tip=np.full(200, np.nan))
    (tmp_path / "text.csv").write_text("drive,x_tip\n1,2\nsoon,3\n4,overload\n")
    lines = message_of(path).splitlines()
    assert [line.split(":")[0] for line in lines] == [
        'records.0 "r00.csv"',
        'records.1 "gone.csv"',
        'records.2 "text.csv"',
        'records.2 "text.csv"',
    ]
    assert 'column "drive" holds text, numbers are needed: "soon", in row 1 (counted from 0)' in lines[2]
    assert '"overload", in row 2' in lines[3]
