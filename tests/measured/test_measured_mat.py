"""MATLAB 5 and 7.3: structs by dotted names, rows and columns alike; what is no number is told."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from rtctl.measured.columns.conversion import TableCache
from rtctl.measured.readers import open_table

X = np.linspace(0.0, 1.0, 12)
RUN = {"x_tip": X, "drive": {"volts": X[::-1].copy()}}


def version_5(path: Path, *, row: bool, packed: bool = False) -> None:
    savemat(path, {"run": RUN, "t": X}, oned_as="row" if row else "column", do_compression=packed)


def version_73(path: Path, *, row: bool) -> None:
    """As MATLAB writes it: a struct is a group, and HDF5 has MATLAB's axes the other way round."""
    across: Callable[[np.ndarray], np.ndarray] = lambda x: x[:, np.newaxis] if row else x[np.newaxis, :]  # noqa: E731
    with h5py.File(path, "w", userblock_size=512) as file:
        file["t"], file["run/x_tip"], file["run/drive/volts"] = across(X), across(X), across(X[::-1])
        for group in ("run", "run/drive"):
            file[group].attrs["MATLAB_class"] = np.bytes_("struct")


@pytest.mark.parametrize("row", [True, False], ids=["row", "column"])
@pytest.mark.parametrize(
    "write",
    [version_5, lambda path, row: version_5(path, row=row, packed=True), version_73],
    ids=["5", "5 packed", "7.3"],
)
def test_fields_of_a_struct_are_columns(tmp_path: Path, write: Callable[..., None], row: bool) -> None:
    path = tmp_path / "r.mat"
    write(path, row=row)
    assert set(open_table(path).columns) == {"t", "run.x_tip", "run.drive.volts"}
    cache = TableCache()
    np.testing.assert_array_equal(cache.column(path, "run.x_tip", "mm"), X)
    np.testing.assert_array_equal(cache.column(path, "run.drive.volts", "V", 2, 7), X[::-1][2:7])
    np.testing.assert_array_equal(cache.column(path, "t", "s", 11, 12), X[11:])


def big_endian(values: np.ndarray) -> bytes:
    """One row `v` in version 5 as a big-endian machine writes it (MAT-File Format, level 5, "miMATRIX")."""
    flags = struct.pack(">IIII", 6, 8, 6, 0)  # miUINT32; mxDOUBLE_CLASS
    shape = struct.pack(">IIii", 5, 8, 1, len(values))
    name = struct.pack(">II", 1, 1) + b"v".ljust(8, b"\0")
    numbers = struct.pack(">II", 9, 8 * len(values)) + values.astype(">f8").tobytes()
    matrix = flags + shape + name + numbers
    header = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack(">H", 0x0100) + b"MI"
    return header + struct.pack(">II", 14, len(matrix)) + matrix


def test_a_file_of_a_big_endian_machine(tmp_path: Path) -> None:
    path = tmp_path / "r.mat"
    path.write_bytes(big_endian(X))
    np.testing.assert_array_equal(TableCache().column(path, "v", "V"), X)
    path.write_bytes(big_endian(X)[:-1])
    with pytest.raises(ValueError, match="is cut off: the variable at byte 128 is not complete"):
        open_table(path)


def cells() -> np.ndarray:
    filled = np.empty(2, dtype=object)
    filled[:] = [X, X]
    return filled


@pytest.mark.parametrize(
    ("variable", "name", "message"),
    [
        (X + 1j, "v", 'column "v" holds complex128, real numbers are needed'),
        (np.zeros((5, 2)), "v", r'column "v" has shape \(5, 2\), one dimension is needed'),
        ({"w": np.zeros((5, 2))}, "v.w", r'column "v.w" has shape \(5, 2\)'),
        ("on", "v", 'column "v" is a MATLAB char, numbers are needed'),
        (cells(), "v", 'column "v" is a MATLAB cell, numbers are needed'),
        ({"w": cells()}, "v.w", 'column "v.w" is a MATLAB cell, numbers are needed'),
        (
            np.array([(1.0,), (2.0,)], dtype=[("w", float)]),
            "v",
            "is a MATLAB struct array, numbers are needed",
        ),
        ({"w": X}, "v", 'no column "v"; did you mean "v.w"'),
        ({"w": X}, "v.ww", 'no column "v.ww"; did you mean "v.w"'),
    ],
)
def test_variables_of_version_5_that_are_no_signal(
    tmp_path: Path, variable: Any, name: str, message: str
) -> None:
    savemat(tmp_path / "r.mat", {"v": variable})
    with pytest.raises(ValueError, match=message):
        TableCache().column(tmp_path / "r.mat", name, "V")


def test_variables_of_version_73_that_are_no_signal(tmp_path: Path) -> None:
    path = tmp_path / "r.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["c"] = np.ones((1, 4), dtype=[("real", "f8"), ("imag", "f8")])  # MATLAB's complex numbers
        file["s"] = np.frombuffer("on".encode("utf-16-le"), np.uint16)[:, np.newaxis]
        file["s"].attrs["MATLAB_class"] = np.bytes_("char")
        file["e"] = np.zeros(2, np.uint64)  # the size of an empty array, not its numbers
        file["e"].attrs["MATLAB_empty"] = np.uint8(1)
        file["m"] = np.zeros((3, 4))
    for name, message in {
        "c": 'column "c" holds complex128, real numbers are needed',
        "s": 'column "s" is a MATLAB char, numbers are needed',
        "m": r'column "m" has shape \(3, 4\)',
    }.items():
        with pytest.raises(ValueError, match=message):
            TableCache().length(path, name, "V")
    assert TableCache().length(path, "e", "V") == 0


# ---- objects


def element(kind: int, content: bytes) -> bytes:
    return struct.pack("<II", kind, len(content)) + content + b"\0" * (-len(content) % 8)


def opaque(name: str, own_class: str) -> bytes:
    """An object in version 5: flags of class 17, no dimensions, then name, family, class, and six numbers."""
    ids = [0xDD000000, 2, 1, 1, 1, 1]
    numbers = element(6, struct.pack("<II", 13, 0)) + element(5, struct.pack("<ii", 6, 1)) + element(1, b"")
    numbers += element(6, struct.pack("<6I", *ids))
    texts = b"".join(element(1, text.encode()) for text in (name, "MCOS", own_class))
    return element(14, element(6, struct.pack("<II", 17, 0)) + texts + element(14, numbers))


def with_object(path: Path, own_class: str, *, first: bool, packed: bool) -> None:
    savemat(path, {"drive": X, "x_tip": 2.0 * X, "run": {"t": X}}, do_compression=packed)
    whole, one = path.read_bytes(), opaque("ts", own_class)
    if packed:
        one = struct.pack("<II", 15, len(zlib.compress(one))) + zlib.compress(one)
    kept = element(6, struct.pack("<II", 9, 0)) + element(5, struct.pack("<ii", 1, 64)) + element(1, b"")
    body = one + whole[128:] if first else whole[128:] + one
    path.write_bytes(whole[:128] + body + element(14, kept + element(2, b"\0" * 64)))


@pytest.mark.parametrize("packed", [True, False])
@pytest.mark.parametrize("first", [True, False])
def test_numbers_beside_an_object_of_version_5_are_read(tmp_path: Path, first: bool, packed: bool) -> None:
    path = tmp_path / "r.mat"
    with_object(path, "timeseries", first=first, packed=packed)
    assert set(open_table(path).columns) == {"drive", "x_tip", "run.t", "ts"}
    np.testing.assert_array_equal(TableCache().column(path, "x_tip", "mm"), 2.0 * X)
    np.testing.assert_array_equal(TableCache().column(path, "run.t", "s", 3, 7), X[3:7])
    with pytest.raises(
        ValueError, match=r'"ts" is a MATLAB timeseries.* in MATLAB: t = ts.Time; x = ts.Data\(:\)'
    ):
        TableCache().length(path, "ts", "mm")


@pytest.mark.parametrize(
    "damage", [struct.pack("<II", 14, 8) + b"\0" * 8, struct.pack("<II", 15, 8) + b"\1" * 8]
)
def test_a_header_of_version_5_that_makes_no_sense(tmp_path: Path, damage: bytes) -> None:
    savemat(tmp_path / "r.mat", {"x": X})
    (tmp_path / "r.mat").write_bytes((tmp_path / "r.mat").read_bytes() + damage)
    with pytest.raises(ValueError, match="damaged"):
        open_table(tmp_path / "r.mat")


@pytest.mark.parametrize(
    "own_class",
    ["timeseries", "datetime", "duration", "string", "table", "timetable", "categorical", "mine", ""],
)
def test_the_numbers_that_stand_for_an_object_of_version_73_are_no_signal(
    tmp_path: Path, own_class: str
) -> None:
    path = tmp_path / "r.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, decode in (("both", 3), ("mark", None)):
            file[name] = np.array([[0xDD000000, 2, 1, 1, 1, 1]], np.uint32)
            if own_class:
                file[name].attrs["MATLAB_class"] = np.bytes_(own_class.encode())
            if decode:
                file[name].attrs["MATLAB_object_decode"] = np.int32(decode)
        file["#subsystem#/MCOS"] = np.zeros(3)
        file["n"] = np.array([[1, 2, 3, 4, 5, 6]], np.uint32)
        file["n"].attrs["MATLAB_class"] = np.bytes_(b"uint32")
    assert set(open_table(path).columns) == {"both", "mark", "n"}
    for name in ("both", "mark"):
        with pytest.raises(
            ValueError, match=f'"{name}" is a MATLAB {own_class or "object"}, an object that only'
        ):
            TableCache().length(path, name, "mm")
    np.testing.assert_array_equal(TableCache().column(path, "n", "mm"), np.arange(1.0, 7.0))
