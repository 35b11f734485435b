"""Text files as instruments and spreadsheets write them: separators, heads, encodings, endings."""

from __future__ import annotations

import gzip
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.border.errors import InputError
from rtctl.measured import read_dataset
from rtctl.measured.columns.conversion import TableCache
from rtctl.measured.readers import open_table

Write = Callable[..., Path]
K = np.arange(40)
A, B = np.round(np.sin(0.3 * K), 6), np.round(0.1 * K, 3)
ROWS = "".join(f"{a:.6f},{b:.3f}\n" for a, b in zip(A, B, strict=True))
PLAIN = f"a,b\n{ROWS}"


def write(folder: Path, text: str | bytes, name: str = "r.csv") -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def column(path: Path, name: str, unit: str = "V") -> np.ndarray:
    return TableCache().column(path, name, unit)


def semicolons(text: str) -> str:
    return text.replace(",", ";").replace(".", ",")


FORMS: dict[str, str | bytes] = {
    "plain": PLAIN,
    "no end": PLAIN[:-1],
    "semicolon, comma": semicolons(PLAIN),
    "semicolon, point": PLAIN.replace(",", ";"),
    "tab": PLAIN.replace(",", "\t"),
    "blanks": PLAIN.replace(",", "  "),
    "right-aligned": "".join(
        f"{one:>14}{other:>12}\n" for one, other in (line.split(",") for line in PLAIN.splitlines())
    ),
    "comma and blank": PLAIN.replace(",", ", "),
    "spaced names": PLAIN.replace("a,b", " a , b "),
    "quoted names": PLAIN.replace("a,b", '"a","b"'),
    "comma in a name": PLAIN.replace(",", "\t")
    .replace("a\tb", 'a\tb\t"c, d, e"')
    .replace("\n", "\t1\n")
    .replace('e"\t1', 'e"'),
    "commas in names of a tab file": "a\tb\tc, d, e\n" + ROWS.replace(",", "\t").replace("\n", "\t1\n"),
    "carriage returns": PLAIN.replace("\n", "\r\n"),
    "old Mac": PLAIN.replace("\n", "\r"),
    "sep line": "sep=;\n" + PLAIN.replace(",", ";"),
    "quoted sep line": '"sep=;"\n' + PLAIN.replace(",", ";"),
    "sep comma": "sep=,\n" + PLAIN,
    "blank lines": "\n\n" + PLAIN.replace("\n", "\n\n"),
    "lines of blanks": "  \n" + PLAIN.replace("\n", "\n   \n", 7),
    "comments": "# bench 3\n# 2026, dry\n" + PLAIN,
    "percent comments": "% bench 3\n" + PLAIN,
    "names in a comment": "# bench 3\n# a,b\n" + ROWS,
    "numpy.savetxt": "# a b\n" + ROWS.replace(",", " "),
    "units row": "a,b\nV,V\n" + ROWS,
    "bracketed units row": "a,b\n[V],(V)\n" + ROWS,
    "units row with gaps": "a,b\n,V\n" + ROWS,
    "preamble": "Instrument: scope 7\nDate: 2026-11-21\n\n" + PLAIN,
    "preamble with commas": "Instrument,scope 7\nDate,2026-11-21\nRate,1000\n\n" + PLAIN,
    "preamble and units": "Model,X7\n\na,b\nV,V\n" + ROWS,
    "duplicate names elsewhere": "a,b,c,c\n" + ROWS.replace("\n", ",1,2\n"),
    "nameless columns": "a,b,,\n" + ROWS.replace("\n", ",1,2\n"),
    "trailing separator": PLAIN.replace("\n", ",\n"),
    "trailing separator below the names": "a,b\n" + ROWS.replace("\n", ",\n"),
    "a column of text": "a,b,what\n" + ROWS.replace("\n", ",on\n"),
    "a column of dates": "when,a,b\n"
    + "".join(f"2026-11-21 10:00:00,{line}\n" for line in ROWS.splitlines()),
    "names that are numbers": "a,b,1,2\n" + ROWS.replace("\n", ",1,2\n"),
    "empty rows at the end": PLAIN + ",\n,\n",
    "byte-order mark": b"\xef\xbb\xbf" + PLAIN.encode(),
    "UTF-16": PLAIN.encode("utf-16"),
    "UTF-16 big-endian": b"\xfe\xff" + PLAIN.encode("utf-16-be"),
    "UTF-16 without its mark": PLAIN.encode("utf-16-le"),
    "Latin-1": PLAIN.replace("a,b", "a,b,µ").replace("\n", ",1\n").replace("µ,1", "µ").encode("latin-1"),
    "gzip": gzip.compress(PLAIN.encode()),
    "gzip of UTF-16": gzip.compress(semicolons(PLAIN).encode("utf-16")),
    "exponents": "a,b\n" + "".join(f"{a:.12E},{b:.12E}\n" for a, b in zip(A, B, strict=True)),
}


@pytest.mark.parametrize("suffix", [".csv", ".txt", ".dat", ".tsv", ".csv.gz"])
@pytest.mark.parametrize("form", FORMS)
def test_every_form_gives_the_same_numbers(tmp_path: Path, form: str, suffix: str) -> None:
    path = write(tmp_path, FORMS[form], f"r{suffix}")
    np.testing.assert_allclose(column(path, "a"), A, atol=1e-12)
    np.testing.assert_allclose(column(path, "b"), B, atol=1e-12)
    np.testing.assert_allclose(TableCache().column(path, "b", "V", 13, 29), B[13:29], atol=1e-12)


@pytest.mark.parametrize("head", [1, 5, 350])
@pytest.mark.parametrize("zero", ["0", "0,0", "1"])
def test_a_decimal_comma_is_found_wherever_it_begins(tmp_path: Path, head: int, zero: str) -> None:
    path = write(tmp_path, "a;b;c\n" + f"{zero};0;0\n" * head + semicolons(ROWS.replace("\n", ",7\n")))
    np.testing.assert_allclose(column(path, "b")[head:], B)
    np.testing.assert_array_equal(column(path, "c")[head:], 7.0)


@settings(deadline=None, max_examples=60)
@given(
    st.lists(st.tuples(st.floats(-1e9, 1e9), st.integers(-99, 99)), min_size=6, max_size=40),
    st.sampled_from([(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), (" ", "."), ("  ", ",")]),
    st.sampled_from(["\n", "\r\n", "\r"]),
    st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]),
    st.sampled_from(["", "# made\n", "\n", "sep"]),
    st.booleans(),
)
def test_what_is_written_in_any_form_is_read(
    rows: list[tuple[float, int]], marks: tuple[str, str], end: str, encoding: str, opening: str, units: bool
) -> None:
    separator, decimal = marks
    if opening == "sep":
        opening = f"sep={separator}\n" if len(separator.strip()) else ""
    lines = [separator.join(["first", "second"]), *([separator.join(["V", "mm"])] if units else [])]
    lines += [separator.join([repr(x).replace(".", decimal), str(n)]) for x, n in rows]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "r.csv"
        path.write_bytes((opening + "\n".join(lines) + "\n").replace("\n", end).encode(encoding))
        np.testing.assert_array_equal(column(path, "first"), [x for x, _ in rows])
        np.testing.assert_array_equal(column(path, "second", "mm"), [n for _, n in rows])


# ---- what was cut off


FIXED = "a,b\n" + "".join(f"{a:.6e},{b:.6e}\n" for a, b in zip(A, B, strict=True))


@pytest.mark.parametrize("lost", range(1, 13))
def test_a_number_that_was_cut_off_is_left_out_and_said(tmp_path: Path, lost: int) -> None:
    table = open_table(write(tmp_path, FIXED[: -1 - lost]))
    assert table.columns["a"].shape == (39,)
    assert "taken as cut off, and left out" in table.remarks[0]
    np.testing.assert_allclose(column(tmp_path / "r.csv", "b"), B[:-1], rtol=1e-6)


def test_the_remark_reaches_the_user(oscillator: Write, tmp_path: Path) -> None:
    path = oscillator()
    whole = (tmp_path / "r00.csv").read_text()
    (tmp_path / "r00.csv").write_text(whole[:-9])
    dataset = read_dataset(path)
    assert dataset.records[0].samples == 199
    assert dataset.remarks[0].startswith('r00.csv: the last line has no end and its last number, "0.')


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        (FIXED[:-1], 40),
        ("a,b\n1,2.25\n1,2", 2),
        ("a,b\n" + "1,2.5\n" * 6 + "1,2.25", 7),
        ("a,b\n" + "1,2.5\n" * 6 + "1,2", 6),
        ("a,b\n" + "1,2.5\n" * 6 + "1,-", 6),
        ("a,b\n" + "1,2.5\n" * 6 + "1", 6),
        ("a,b\n" + "1,2.5\n" * 6 + "1,", 6),
        ("a,b\n" + "1,2e+00\n" * 6 + "1,2.25e+0", 6),
        ("a,b\n" + "1,2e0\n" * 6 + "1,2.25e0", 7),
        ("a,b\n" + "1,2\n1,2.5\n" * 6 + "1,3", 13),
        ("a\n" + "2.5\n" * 6 + "2", 6),
        ("a;b\n" + "1;2,5\n" * 6 + "1;2", 6),
        ("a,b\n" + "1,2\n" * 9 + "\0" * 99, 9),
    ],
)
def test_a_last_line_without_its_end_is_held_against_those_before(
    tmp_path: Path, text: str, rows: int
) -> None:
    table = open_table(write(tmp_path, text))
    assert {header.shape for header in table.columns.values()} == {(rows,)}
    for name in table.columns:
        assert np.isfinite(column(tmp_path / "r.csv", name)).all()


@pytest.mark.parametrize("share", [0.2, 0.6, 0.99])
def test_a_packed_file_that_was_cut_off_is_told(tmp_path: Path, share: float) -> None:
    packed = gzip.compress(PLAIN.encode())
    with pytest.raises(ValueError, match="is cut off: the packed file does not have its end"):
        open_table(write(tmp_path, packed[: int(share * len(packed))], "r.csv.gz"))


def test_a_packed_file_that_grows_without_end_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rtctl.measured.readers.delimited.text.LARGEST_COPY", 1000)
    with pytest.raises(ValueError, match="when it is unpacked; unpack it to a plain file"):
        open_table(write(tmp_path, gzip.compress(b"a,b\n" + b"0,0\n" * 100_000), "r.csv.gz"))
    with pytest.raises(ValueError, match=r"is larger than 0 MB and not plain CSV in UTF-8"):
        open_table(write(tmp_path, (PLAIN * 4).encode("utf-16")))


@pytest.mark.parametrize(
    ("text", "name", "message"),
    [
        (
            "a,b,a\n1,2,3\n4,5,6\n",
            "a",
            'column "a" is not clear, as two columns have the same name; rename one',
        ),
        ("a,b\n1,2\n3,4\n5,6\nx,8\n", "a", '"x", in row 3'),
        ("a;b\n1.5;2,5\n2.5;3,5\n", "b", None),
        ("a;b\n1.234,5;2\n", "a", 'numbers are needed: "1.234,5", in row 0'),
        ("1;2\n3;4\n", "a", 'no column "a"; known: column_1, column_2'),
        ("# only\n", "a", "the header line is empty"),
    ],
)
def test_faults_of_text_files(tmp_path: Path, text: str, name: str, message: str | None) -> None:
    path = write(tmp_path, text)
    if message is None:
        np.testing.assert_array_equal(column(path, name), [2.5, 3.5])
        return
    with pytest.raises(ValueError, match=message):
        column(path, name)


def test_a_units_row_of_another_unit_is_an_error(tmp_path: Path) -> None:
    path = write(tmp_path, "a,b\nmV,blorps\n" + ROWS)
    with pytest.raises(ValueError, match='the file states unit "mV" for column "a", the manifest "V"'):
        column(path, "a")


def test_records_of_packed_files_go_by_their_name_alone(oscillator: Write, tmp_path: Path) -> None:
    path = oscillator(('"r00.csv"', '"r00.csv.gz"'))
    (tmp_path / "r00.csv.gz").write_bytes(gzip.compress((tmp_path / "r00.csv").read_bytes()))
    assert read_dataset(path).records[0].name == "r00"
    assert read_dataset(str(path)).records[0].samples == 200


def test_a_data_file_in_the_place_of_a_manifest(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is a data file; a manifest is needed, which names its columns"):
        read_dataset(write(tmp_path, PLAIN))


@pytest.mark.parametrize(
    "text",
    [
        "0;1,5\n1;-3,25\n",
        "0\t1.5\n1\t-3.25\n",
        "  0.0   1.5\n  1.0  -3.25\n",
        "# from the scope\n0,1.5\n1,-3.25\n",
        "0,1.5\n1,-3.25\n",
    ],
)
def test_columns_that_no_line_names_are_numbered(tmp_path: Path, text: str) -> None:
    path = write(tmp_path, text)
    assert tuple(open_table(path).columns) == ("column_1", "column_2")
    np.testing.assert_array_equal(column(path, "column_1"), [0.0, 1.0])
    np.testing.assert_array_equal(column(path, "column_2"), [1.5, -3.25])


def test_a_lone_quote_in_a_title_is_read_and_one_among_the_rows_is_told_with_its_line(tmp_path: Path) -> None:
    title = 'Woofer 6" laser\n'
    assert np.allclose(column(write(tmp_path, title + semicolons(PLAIN)), "a"), A)
    rows = semicolons(PLAIN).splitlines()
    rows[5] += '"'
    with pytest.raises(ValueError, match="line 7: a line break stands inside quotes"):
        column(write(tmp_path, title + "\n".join(rows)), "a")
