"""One measurement in every format gives the same numbers, and each format's own faults have a message."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.feather
import pyarrow.parquet as pq
import pytest
from measured_files import uff58, write_tdms, write_uff
from scipy.io import savemat

from rtctl.measured.columns.conversion import TableCache
from rtctl.measured.readers import READERS, mat, open_table, suffix_of

A, B = np.round(np.linspace(-1.0, 1.0, 50) ** 3, 9), np.arange(50)  # nine digits: text files keep twelve


def table() -> pa.Table:
    return pa.table({"a": A, "b": B})


def write_stream(path: Path) -> None:
    with pa.OSFile(str(path), "wb") as sink, pa.ipc.new_stream(sink, table().schema) as writer:
        writer.write_table(table())


def write_h5(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["a"], file["b"] = A, B


def write_mat73(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:  # MATLAB's own header stands in front
        file["a"], file["b"] = A[np.newaxis, :], B[np.newaxis, :]


def write_packed(path: Path) -> None:
    with pa.CompressedOutputStream(str(path), "gzip") as sink:
        pa.csv.write_csv(table(), sink)


WRITERS: dict[str, Callable[[Path], object]] = {
    "comma.csv": lambda path: pa.csv.write_csv(table(), path),
    "upper.CSV": lambda path: pa.csv.write_csv(table(), path),
    "plain.parquet": lambda path: pq.write_table(table(), path),
    "groups.parquet": lambda path: pq.write_table(table(), path, row_group_size=7),
    "batches.arrow": lambda path: pa.feather.write_feather(table(), path, chunksize=7, compression="lz4"),
    "file.arrow": lambda path: pa.feather.write_feather(table(), path),
    "stream.arrow": write_stream,
    "plain.npz": lambda path: np.savez(path, a=A, b=B),
    "packed.npz": lambda path: np.savez_compressed(path, a=A, b=B),
    "row.mat": lambda path: savemat(path, {"a": A, "b": B}),
    "column.mat": lambda path: savemat(path, {"a": A, "b": B}, oned_as="column"),
    "plain.h5": write_h5,
    "v73.mat": write_mat73,
    "one.tdms": lambda path: write_tdms(path, {"a": A, "b": B}),
    "plain.txt": lambda path: pa.csv.write_csv(table(), path),
    "plain.dat": lambda path: pa.csv.write_csv(table(), path),
    "plain.asc": lambda path: pa.csv.write_csv(table(), path),
    "plain.lvm": lambda path: pa.csv.write_csv(table(), path, pa.csv.WriteOptions(delimiter="\t")),
    "plain.tsv": lambda path: pa.csv.write_csv(table(), path, pa.csv.WriteOptions(delimiter="\t")),
    "packed.csv.gz": write_packed,
    "plain.hdf5": write_h5,
    "plain.feather": lambda path: pa.feather.write_feather(table(), path),
    "streamed.tdms": lambda path: write_tdms(path, {"a": A, "b": B}, segments=7),
    "text.uff": lambda path: write_uff(path, [uff58(A, id1="a"), uff58(B, id1="b")]),
    "binary.unv": lambda path: write_uff(
        path, [uff58(A, id1="a", binary=True), uff58(B, id1="b", binary=True)]
    ),
}


MDF = {".mf4", ".mdf"}
"""Suffixes of an extra that the tests do not need: tests of their own."""


def column(path: Path, name: str, unit: str = "V") -> np.ndarray:
    return TableCache().column(path, name, unit)


@pytest.mark.parametrize("name", WRITERS)
def test_one_measurement_is_the_same_in_every_format(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    WRITERS[name](path)
    assert set(open_table(path).columns) == {"a", "b"}
    np.testing.assert_array_equal(column(path, "a"), A)
    np.testing.assert_array_equal(column(path, "b"), B)


@pytest.mark.parametrize("rows", [(0, 50), (0, 1), (13, 29), (49, 50)])
@pytest.mark.parametrize("name", WRITERS)
def test_rows_of_a_column_are_the_same_in_every_format(
    tmp_path: Path, name: str, rows: tuple[int, int]
) -> None:
    path, (first, end) = tmp_path / name, rows
    WRITERS[name](path)
    assert TableCache().length(path, "a", "V") == 50
    np.testing.assert_array_equal(open_table(path).load("a", first, end).ravel(), A[first:end])
    np.testing.assert_array_equal(TableCache().column(path, "b", "V", first, end), B[first:end])


TEXTS = (".csv", ".txt", ".dat", ".tsv", ".asc", ".lvm")
CUT = [name for name in WRITERS if not name.lower().endswith(TEXTS)]  # whose every line may be the last


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
@pytest.mark.parametrize("name", CUT)
def test_a_file_that_was_cut_off_is_told(tmp_path: Path, name: str, share: float) -> None:
    path = tmp_path / name
    WRITERS[name](path)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(ValueError, match=r"^not an? .*(damaged|cut off)|^is cut off|ends after"):
        column(path, "b")


def test_every_reader_of_the_registry_is_tried_above() -> None:
    assert {suffix_of(Path(name)) for name in WRITERS} == set(READERS) - MDF


@pytest.mark.parametrize("suffix", sorted(set(READERS) - MDF))
def test_a_file_that_is_not_what_its_suffix_says(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"liar{suffix}"
    path.write_bytes(b"%PDF-1.7\n\x00\xff\xfe,\n\x01\x02")
    with pytest.raises(ValueError, match=r"^not an? |^not readable as gzip|is a PDF by its first bytes"):
        column(path, "a")


@pytest.mark.parametrize("suffix", sorted(READERS))
def test_an_empty_file(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"empty{suffix}"
    path.touch()
    with pytest.raises(ValueError, match=r"the file is empty \(0 bytes\)"):
        open_table(path)


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    (tmp_path / "a.csv").mkdir()
    with pytest.raises(ValueError, match="is a folder"):
        open_table(tmp_path / "a.csv")


def test_hdf5_without_h5py_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "v73.mat"
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF\r\n\x1a\n")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(ValueError, match=r"needs h5py: pip install .rtctl.readers.., or save as Parquet"):
        mat.read(path)


def csv(folder: Path, text: str | bytes) -> Path:
    path = folder / "r.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


@pytest.mark.parametrize(
    "text",
    [
        "a;b\n1.5;2\n-3;4\n",
        "a;b\n1,5;2\n-3,0;4\n",
        "a\tb\n1.5\t2\n-3\t4\n",
        "a,b\r\n1.5,2\r\n-3,4\r\n",
        " a , b \n1.5, 2\n-3, 4\n",
        "# from the bench\n# room 23 degC, dry\na,b\n1.5,2\n-3,4\n",
        '"a","b"\n1.5,2\n-3,4\n',
        b"\xef\xbb\xbfa,b\n1.5,2\n-3,4\n",
        b"\xef\xbb\xbf# from the bench\na,b\n1.5,2\n-3,4\n",
        "b,a\n2,1.5\n4,-3",
    ],
)
def test_csv_as_instruments_and_spreadsheets_write_it(tmp_path: Path, text: str | bytes) -> None:
    path = csv(tmp_path, text)
    np.testing.assert_array_equal(column(path, "a"), [1.5, -3.0])
    np.testing.assert_array_equal(column(path, "b"), [2.0, 4.0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1.0,2.0\n3.0,4.0\n", 'no column "a"; known: column_1, column_2'),
        (
            "a,b\n1,2,3\n",
            "not readable as CSV: line 2 has 3 cells, the file has 2 columns.*a decimal comma.*semicolons",
        ),
        (
            "a;b\n1;2;3\n",
            'not readable as CSV: line 2 has 3 cells, the file has 2 columns: correct or remove that line, "1;2;3";',
        ),
        ('a,b\n"1\n2",3\n', "a line break stands inside quotes"),
        ("a,a\n1,2\n", "two columns have the same name"),
        ("a,b\n1,2\nsoon,3\n", 'column "a" holds text, numbers are needed: "soon", in row 1'),
        ("a,b\n,2\nsoon,3\n", 'numbers are needed: "soon", in row 1'),
        ("a,b\n2026-01-01 10:00:00,2\n", 'numbers are needed: "2026-01-01 10:00:00", in row 0'),
    ],
)
def test_csv_faults(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        column(csv(tmp_path, text), "a")


def test_missing_and_infinite_cells_of_csv_arrive_to_be_refused_by_row(tmp_path: Path) -> None:
    np.testing.assert_array_equal(
        column(csv(tmp_path, "a,b\n1,\n,\nnan,\n-inf,\n"), "a"), [1.0, np.nan, np.nan, -np.inf]
    )
    assert np.isnan(column(csv(tmp_path, "a,b\n1,\n,\n"), "b")).all()


def test_a_unit_in_the_file_that_contradicts_the_manifest(tmp_path: Path) -> None:
    path = tmp_path / "r.parquet"
    schema = pa.schema(
        [
            pa.field("a", pa.float64(), metadata={"unit": "ohm"}),
            pa.field("b", pa.int64(), metadata={"unit": "??"}),
        ]
    )
    pq.write_table(table().cast(schema), path)
    np.testing.assert_array_equal(column(path, "a", "Ω"), A)
    with pytest.raises(ValueError, match='the file states unit "ohm" for column "a", the manifest "kohm"'):
        column(path, "a", "kohm")
    np.testing.assert_array_equal(column(path, "b", "kohm"), B)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (np.zeros((5, 2)), r'column "a" has shape \(5, 2\)'),
        (1j * np.ones(5), 'column "a" holds complex128, real numbers are needed'),
        (np.array(["1", "x"]), 'holds text, numbers are needed: "x", in row 1'),
        (np.array(["1", "2"]), "holds numbers as text; store them as numbers"),
    ],
)
def test_arrays_that_are_no_signal(tmp_path: Path, value: np.ndarray, message: str) -> None:
    np.savez(tmp_path / "r.npz", a=value)
    with pytest.raises(ValueError, match=message):
        column(tmp_path / "r.npz", "a")


def test_a_gap_among_text_is_not_called_text(tmp_path: Path) -> None:
    pq.write_table(pa.table({"a": ["1.5", None, "x"]}), tmp_path / "r.parquet")
    with pytest.raises(ValueError, match=r'"x", in row 2 \(counted from 0\)'):
        column(tmp_path / "r.parquet", "a")


def test_matlab_s_own_references_are_no_columns(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "r.mat", "w", userblock_size=512) as file:
        file["a"], file["#refs#/b"], file["run/c"] = A, B, A
    assert set(open_table(tmp_path / "r.mat").columns) == {"a", "run.c"}


def test_python_objects_are_not_unpickled(tmp_path: Path) -> None:
    np.savez(tmp_path / "r.npz", a=np.array([print, None], dtype=object))
    with pytest.raises(ValueError, match='column "a" holds Python objects'):
        column(tmp_path / "r.npz", "a")


def test_a_file_of_several_records_is_read_once_where_a_part_costs_the_whole(tmp_path: Path) -> None:
    path = tmp_path / "r.mat"
    savemat(path, {"a": A})
    cache = TableCache(shared=[path])
    first = cache.column(path, "a", "V")
    path.unlink()
    assert cache.column(path, "a", "V") is first
    part = cache.column(path, "a", "V", 3, 9)
    np.testing.assert_array_equal(part, A[3:9])
    assert part.base is None, "a view would keep the whole column alive"


def test_what_is_kept_has_a_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rtctl.measured.columns.conversion.KEPT_BYTES", 4 * A.nbytes)
    path = tmp_path / "r.mat"
    savemat(path, dict.fromkeys("abcdefgh", A))
    cache = TableCache(shared=[path])
    kept = {name: cache.column(path, name, "V") for name in "abcdefgh"}
    path.unlink()
    for name in "efgh":
        assert cache.column(path, name, "V") is kept[name]
    with pytest.raises(ValueError, match="not a MATLAB file, or damaged"):
        cache.column(path, "a", "V")
