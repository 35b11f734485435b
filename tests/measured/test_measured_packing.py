"""Scales, offsets, fill values and limits that a file states are obeyed, in HDF5 and in Arrow metadata."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from rtctl.border.errors import InputError
from rtctl.measured import open_dataset, read_dataset
from rtctl.measured.columns.conversion import TableCache
from rtctl.measured.readers.stated.attributes import Packing, unpack

Write = Callable[..., Path]
K = np.arange(200)


def h5(folder: Path, attributes: dict[str, Any], values: np.ndarray, name: str = "r00.h5") -> Path:
    with h5py.File(folder / name, "w") as file:
        file["drive"] = np.sin(0.1 * K)
        file["x_tip"] = values
        file["x_tip"].attrs.update(attributes)
    return folder / name


def column(path: Path, unit: str = "mm") -> np.ndarray:
    return TableCache().column(path, "x_tip", unit)


def gap(values: np.ndarray, at: int) -> np.ndarray:
    values = values.astype(float)
    values[at] = np.nan
    return values


COUNTS = K.astype(np.int16)


@pytest.mark.parametrize(
    ("attributes", "stored", "readings"),
    [
        ({"scale_factor": 0.5, "add_offset": 3.0}, COUNTS, 0.5 * K + 3.0),
        ({"scale_factor": np.array([0.5])}, COUNTS, 0.5 * K),
        ({"add_offset": np.float32(3.0)}, COUNTS, K + 3.0),
        ({"scale_factor": "0.5"}, COUNTS, 0.5 * K),
        ({"scale_factor": np.bytes_(b"0.5")}, COUNTS, 0.5 * K),
        ({"Scale_Factor": 0.5}, COUNTS, 0.5 * K),
        ({"_FillValue": np.int16(7)}, COUNTS, gap(K, 7)),
        ({"missing_value": np.array([7], np.int16)}, COUNTS, gap(K, 7)),
        ({"missing_value": np.array([7, 7], np.int16), "scale_factor": 2.0}, COUNTS, gap(2.0 * K, 7)),
        ({"_FillValue": np.float32(1e20)}, np.where(K == 7, 1e20, K).astype(np.float32), gap(K, 7)),
        ({"_FillValue": np.nan}, K.astype(float), K),
        ({"valid_range": np.array([8, 500])}, COUNTS, np.where(K < 8, np.nan, K)),
        ({"valid_min": 8}, COUNTS, np.where(K < 8, np.nan, K)),
        ({"valid_max": 190, "scale_factor": 0.1}, COUNTS, np.where(K > 190, np.nan, 0.1 * K)),
        ({"_Unsigned": "true"}, (K - 100).astype(np.int8), (K - 100).astype(np.int8).view(np.uint8)),
    ],
)
def test_what_a_file_says_of_its_numbers_is_applied(
    tmp_path: Path, attributes: dict[str, Any], stored: np.ndarray, readings: np.ndarray
) -> None:
    path = h5(tmp_path, attributes, stored)
    np.testing.assert_allclose(column(path), readings, rtol=1e-15)
    np.testing.assert_allclose(
        TableCache().column(path, "x_tip", "mm", 5, 12), np.asarray(readings)[5:12], rtol=1e-15
    )


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ({"scale_factor": 0.0}, "states a scale_factor of 0"),
        ({"scale_factor": "half"}, "states scale_factor = half, which is no number"),
        ({"scale_factor": [0.5, 0.6]}, "one finite number is needed"),
        ({"add_offset": np.nan}, "one finite number is needed"),
        ({"valid_range": [1.0]}, "two numbers are needed"),
    ],
)
def test_what_cannot_be_obeyed_is_refused(tmp_path: Path, attributes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=f'column "x_tip" .*{message}'):
        column(h5(tmp_path, attributes, COUNTS))


def test_a_fill_value_among_the_readings_is_told_with_its_row(oscillator: Write, tmp_path: Path) -> None:
    h5(tmp_path, {"_FillValue": np.int16(7)}, COUNTS)
    with pytest.raises(InputError, match=r'column "x_tip" is NaN in 1 of 200 rows: row 7 \(counted from 0\)'):
        read_dataset(oscillator(('"r00.csv"', '"r00.h5"')))


@pytest.mark.parametrize("key", ["gain", "Sensitivity", "slope"])
def test_an_attribute_that_may_scale_is_not_passed_over(oscillator: Write, tmp_path: Path, key: str) -> None:
    h5(tmp_path, {key: 0.5}, COUNTS)
    dataset = read_dataset(oscillator(('"r00.csv"', '"r00.h5"')))
    assert any(f"the file states {key} = 0.5, which is not applied" in one for one in dataset.remarks)
    np.testing.assert_array_equal(dataset.records[0].signals["displacement"], K)


@pytest.mark.parametrize("suffix", ["parquet", "arrow"])
def test_metadata_of_an_arrow_field_scale_its_numbers(tmp_path: Path, suffix: str) -> None:
    metadata = {"scale_factor": "0.5", "add_offset": "3", "_FillValue": "7", "units": "mm"}
    field = pa.field("x_tip", pa.int16(), metadata=metadata)
    table = pa.Table.from_arrays([pa.array(COUNTS)], schema=pa.schema([field]))
    path = tmp_path / f"r.{suffix}"
    if suffix == "parquet":
        pq.write_table(table, path)
    else:
        with pa.OSFile(str(path), "wb") as sink, pa.ipc.new_file(sink, table.schema) as writer:
            writer.write_table(table)
    np.testing.assert_allclose(column(path), gap(0.5 * K + 3.0, 7))
    with pytest.raises(ValueError, match='states unit "mm"'):
        column(path, "um")


@pytest.mark.parametrize(
    ("values", "readings"),
    [
        (pa.array([1, 2, 3], pa.int8()).cast(pa.decimal128(10, 2)), [1.0, 2.0, 3.0]),
        (pa.array([1.5, 2.5, 1.5]).dictionary_encode(), [1.5, 2.5, 1.5]),
    ],
)
def test_numbers_of_other_arrow_types_are_numbers(
    tmp_path: Path, values: pa.Array, readings: list[float]
) -> None:
    pq.write_table(pa.table({"x_tip": values}), tmp_path / "r.parquet")
    np.testing.assert_array_equal(column(tmp_path / "r.parquet"), readings)


def test_counts_are_scaled_by_the_manifest_before_their_unit(oscillator: Write, tmp_path: Path) -> None:
    h5(tmp_path, {"units": "counts"}, COUNTS)
    scaled = ('unit = "mm"', 'unit = "mm"\nscale = 0.01\noffset = -1.0')
    dataset = read_dataset(oscillator(('"r00.csv"', '"r00.h5"'), scaled))
    np.testing.assert_allclose(dataset.records[0].signals["displacement"], 0.01 * K - 1.0)


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("scale = 0", "0 leaves nothing of the signal"),
        ("scale = nan", "nan is not a finite number"),
        ('scale = "0.1"', "'0.1' is not a finite number"),
        ("offset = inf", "inf is not a finite number"),
        ("offset = true", "True is not a finite number"),
    ],
)
def test_a_scale_that_is_none(oscillator: Write, key: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        open_dataset(oscillator(('unit = "mm"', f'unit = "mm"\n{key}')))


# ---- numbers that are not there


def virtual(path: Path, source: str, *, rows: int = 200, mapped: int = 200, dataset: str = "x") -> None:
    layout = h5py.VirtualLayout((rows,), "f8")
    layout[:mapped] = h5py.VirtualSource(source, dataset, (mapped,))
    with h5py.File(path, "w") as file:
        file["drive"] = np.zeros(rows)
        file.create_virtual_dataset("x_tip", layout)


def source(path: Path, rows: int = 200, name: str = "x") -> None:
    with h5py.File(path, "w") as file:
        file[name] = np.arange(float(rows))


def test_a_virtual_dataset_whose_source_is_there_is_read(tmp_path: Path) -> None:
    source(tmp_path / "s.h5")
    virtual(tmp_path / "r.h5", "s.h5")
    np.testing.assert_array_equal(column(tmp_path / "r.h5"), K)
    layout = h5py.VirtualLayout((100,), "f8")
    layout[:] = h5py.VirtualSource("s.h5", "x", (200,))[100:]
    with h5py.File(tmp_path / "part.h5", "w") as file:
        file.create_virtual_dataset("x_tip", layout)
    np.testing.assert_array_equal(column(tmp_path / "part.h5"), K[100:])
    source(tmp_path / "s.h5", rows=150)
    with pytest.raises(ValueError, match=r"is shorter, \(150,\), than what is taken from it"):
        column(tmp_path / "part.h5")
    with h5py.File(tmp_path / "own.h5", "w") as file:
        file["x"] = K.astype(float)
        layout = h5py.VirtualLayout((200,), "f8")
        layout[:] = h5py.VirtualSource(".", "x", (200,))
        file.create_virtual_dataset("x_tip", layout)
    np.testing.assert_array_equal(column(tmp_path / "own.h5"), K)


def no_file(folder: Path) -> None:
    virtual(folder / "r.h5", "gone.h5")


def no_dataset(folder: Path) -> None:
    source(folder / "s.h5", name="y")
    virtual(folder / "r.h5", "s.h5")


def shorter(folder: Path) -> None:
    source(folder / "s.h5", rows=150)
    virtual(folder / "r.h5", "s.h5")


def partly_mapped(folder: Path) -> None:
    source(folder / "s.h5")
    virtual(folder / "r.h5", "s.h5", rows=300)


def no_hdf5(folder: Path) -> None:
    (folder / "s.h5").write_text("nothing")
    virtual(folder / "r.h5", "s.h5")


def unwritten_source(folder: Path) -> None:
    with h5py.File(folder / "s.h5", "w") as file:
        file.create_dataset("x", (200,), "f8", chunks=(50,))[:60] = 1.0
    virtual(folder / "r.h5", "s.h5")


def source_of_a_source(folder: Path) -> None:
    with h5py.File(folder / "s.h5", "w") as file:
        layout = h5py.VirtualLayout((200,), "f8")
        layout[:] = h5py.VirtualSource("gone.h5", "x", (200,))
        file.create_virtual_dataset("x", layout)
    virtual(folder / "r.h5", "s.h5")


def never_written(folder: Path) -> None:
    with h5py.File(folder / "r.h5", "w") as file:
        file.create_dataset("x_tip", (200,), "f8")


def outside(folder: Path) -> None:
    with h5py.File(folder / "r.h5", "w") as file:
        file.create_dataset("x_tip", (200,), "f8", external=[("raw.bin", 0, 1600)])
    (folder / "raw.bin").unlink(missing_ok=True)


@pytest.mark.parametrize(
    ("write", "message"),
    [
        (no_file, 'its source "x" in "gone.h5" is not there: no such file; put it beside this file'),
        (no_dataset, 'its source "x" in "s.h5" is not there: no such dataset in the file'),
        (shorter, r"is shorter, \(150,\), than what is taken from it"),
        (partly_mapped, "100 of its 300 numbers come from no source"),
        (no_hdf5, "cannot be read: not an HDF5 file, or damaged"),
        (unwritten_source, "was never written from row 100 on"),
        (
            source_of_a_source,
            'its source "x" in "s.h5" is virtual, and its source "x" in "gone.h5" is not there',
        ),
        (never_written, "was created, but its numbers were never written"),
        (outside, 'is kept in the file "raw.bin", which is not there'),
    ],
)
def test_numbers_that_are_not_there_are_no_zeros(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, write: Callable[[Path], None], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path)
    with pytest.raises(ValueError, match=f'column "x_tip" .*{message}'):
        column(tmp_path / "r.h5")


@pytest.mark.parametrize("shape", [(200,), (200, 1), (1, 200)])
def test_unwritten_chunks_are_told_unless_the_rows_lie_elsewhere(
    tmp_path: Path, shape: tuple[int, ...]
) -> None:
    chunks = tuple(min(size, 50) for size in shape)
    with h5py.File(tmp_path / "r.h5", "w") as file:
        dataset = file.create_dataset("x_tip", shape, "f8", chunks=chunks)
        written = np.arange(100.0).reshape([min(size, 100) for size in shape])
        dataset[tuple(slice(size) for size in written.shape)] = written
    with pytest.raises(
        ValueError, match=r'column "x_tip" was never written in rows 100 to 149 .* leave them out'
    ):
        column(tmp_path / "r.h5")
    cache = TableCache()
    np.testing.assert_array_equal(
        cache.column(tmp_path / "r.h5", "x_tip", "mm", 20, 100), np.arange(20.0, 100.0)
    )
    with pytest.raises(ValueError, match="rows 180 to 189"):
        cache.column(tmp_path / "r.h5", "x_tip", "mm", 180, 190)


@pytest.mark.parametrize(("stored", "read"), [(9999.0, np.nan), (2.0, 2.0)])
def test_a_single_number_may_be_the_one_for_no_reading(stored: float, read: float) -> None:
    """Found by random inputs: a scalar dataset with a fill value."""
    np.testing.assert_array_equal(unpack(np.array(stored), Packing(missing=(9999.0,))), read)
