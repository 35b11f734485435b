"""Files larger than memory: a record costs its own rows and columns, and records read one by one cost one."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from measured_files import write_tdms

from rtctl.measured.readers.delimited.text import Text, index_lines

NAMES = ("drive", "x_tip", "spare_1", "spare_2")
ROWS = 1_000_000
FILE_MB = 8 * len(NAMES) * ROWS / 1e6
STATUS = Path("/proc/self/status")

# The child reports its own highest resident memory, VmHWM: ru_maxrss would begin with that of pytest, from which
# it is started.
PROBE = """
import sys
from pathlib import Path
from rtctl.measured import open_dataset

def peak_MB():
    (line,) = [line for line in open("/proc/self/status") if line.startswith("VmHWM")]
    return int(line.split()[1]) / 1e3

sum(record.samples for record in open_dataset(Path(sys.argv[1])))  # imports, unit registry, buffers of parsers
before = peak_MB()
samples = sum(record.samples for record in open_dataset(Path(sys.argv[2])))
print(samples, peak_MB() - before)
"""

MANIFEST = """
[dataset]
name = "long"
plant = "oscillator"
[signals.drive]
role = "input"
unit = "V"
[signals.displacement]
role = "output"
unit = "mm"
column = "x_tip"
"""
RECORD = '[[records]]\nname = "{name}"\nfile = "{file}"\nsample_rate_hz = 1000.0\n'


def table(rows: int) -> pa.Table:
    numbers = np.random.default_rng(7).standard_normal(rows)
    return pa.table({name: numbers + k for k, name in enumerate(NAMES)})


def write_arrow(path: Path, rows: int) -> None:
    with pa.OSFile(str(path), "wb") as sink, pa.ipc.new_file(sink, table(rows).schema) as writer:
        writer.write_table(table(rows), max_chunksize=65_536)


def write_h5(path: Path, rows: int) -> None:
    with h5py.File(path, "w") as file:
        for name, values in columns(rows).items():
            file[name] = values


def columns(rows: int) -> dict[str, np.ndarray]:
    return {name: column.to_numpy() for name, column in zip(NAMES, table(rows).columns, strict=True)}


WRITERS: dict[str, Callable[[Path, int], object]] = {
    "r.parquet": lambda path, rows: pq.write_table(table(rows), path, row_group_size=ROWS),
    "r.arrow": write_arrow,
    "r.h5": write_h5,
    "r.tdms": lambda path, rows: write_tdms(path, columns(rows), segments=20),
    "r.npz": lambda path, rows: np.savez(path, **columns(rows)),
    "packed.npz": lambda path, rows: np.savez_compressed(path, **{n: np.zeros(rows) for n in NAMES}),
    "r.csv": lambda path, rows: pa.csv.write_csv(table(rows), path),
}
WEEKLY = ("r.csv", "r.arrow", "r.h5", "r.tdms", "packed.npz")


def peak_of_reading(warm: Path, path: Path) -> tuple[int, float]:
    """Samples of all records, read one by one, and by how many MB memory rose above that for `warm`."""
    if not STATUS.exists():
        pytest.skip("memory is read from /proc")
    command = [sys.executable, "-W", "error", "-c", PROBE, str(warm), str(path)]
    environment = os.environ | {
        "ARROW_DEFAULT_MEMORY_POOL": "system",
        "MALLOC_ARENA_MAX": "1",
    }  # no pools kept
    answer = subprocess.run(
        command, check=True, capture_output=True, text=True, env=environment
    ).stdout.split()
    return int(answer[0]), float(answer[1])


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=[pytest.mark.slow] if one in WEEKLY else []) for one in WRITERS]
)
def test_a_few_rows_of_a_large_file_cost_a_small_part_of_it(tmp_path: Path, name: str) -> None:
    rows = "rows = [700000, 710000]\n"
    for folder, count, chosen in (("warm", ROWS // 10, ""), ("large", ROWS, rows)):
        (tmp_path / folder).mkdir()
        WRITERS[name](tmp_path / folder / name, count)
        text = MANIFEST + RECORD.format(name="r", file=name) + chosen
        (tmp_path / folder / "dataset.toml").write_text(text)
    samples, risen_MB = peak_of_reading(*(tmp_path / folder / "dataset.toml" for folder in ("warm", "large")))
    (tmp_path / "large" / name).unlink()
    assert samples == 10_000
    # a mapped file counts with what the kernel reads ahead of it, up to 11 MB of 32 seen
    assert risen_MB < FILE_MB / 2, "less than two whole columns, and less than half of the file"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["r.npz", "r.csv"])
def test_records_read_one_by_one_cost_little_more_than_one(tmp_path: Path, name: str) -> None:
    count, each = (400, 300_000) if name == "r.npz" else (40, 100_000)
    WRITERS[name](tmp_path / name, each)
    for folder, records in (("one", 1), ("many", count)):
        (tmp_path / folder).mkdir()
        for k in range(records):
            os.link(tmp_path / name, tmp_path / folder / f"{k}-{name}")
        text = MANIFEST + "".join(RECORD.format(name=k, file=f"{k}-{name}") for k in range(records))
        (tmp_path / folder / "dataset.toml").write_text(text)
    samples, risen_MB = peak_of_reading(*(tmp_path / folder / "dataset.toml" for folder in ("one", "many")))
    (tmp_path / name).unlink()
    assert samples == count * each
    record_MB = 2 * 8 * each / 1e6
    assert risen_MB < min(100.0, 0.2 * count * record_MB) + 4 * record_MB


@settings(deadline=None)
@given(
    st.lists(st.sampled_from([b"1,2", b"\n", b"\r\n", b"\r", b"x", b'"y"']), max_size=30), st.integers(0, 5)
)
def test_lines_are_found_as_python_splits_them(parts: list[bytes], head: int) -> None:
    text = b"".join(parts)
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr("rtctl.measured.readers.delimited.text.BLOCK_BYTES", 4)
        path = Path(folder) / "lines"
        path.write_bytes(text)
        count, index, _ = index_lines(Text(path), head)
    lines = [line for line in text.splitlines() if line]
    assert count == len(lines)
    assert (not index) == (count <= head)
    for number, byte in index:
        assert text[byte:].splitlines()[0] == lines[number]
        assert number == sum(bool(line) for line in text[:byte].splitlines()), (
            "and every line before it is counted"
        )
        assert number >= head
