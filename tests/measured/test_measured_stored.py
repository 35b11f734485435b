"""A dataset opened record by record says and gives what the whole one does, and says what is wrong at once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rtctl.border.errors import InputError
from rtctl.measured import Dataset, StoredDataset, open_dataset, read_dataset

Write = Callable[..., Path]
RATE = "sample_rate_hz = 1000.0"
THREE = f"""{RATE}
rows = [0, 50]
repeat = "A"
[[records]]
file = "r00.csv"
{RATE}
rows = [50, 120]
repeat = "A"
use = "test"
conditions = {{ lid = "shut" }}
[[records]]
file = "r00.csv"
name = "whole"
time = "t"
resample = true
initial = {{ displacement = 0.5 }}"""
T = np.cumsum(np.where(np.arange(200) % 50 == 49, 0.003, 0.001))


def test_the_records_of_an_opened_dataset_are_those_of_the_whole(oscillator: Write) -> None:
    path = oscillator((RATE, THREE), t=T)
    opened, whole = open_dataset(path), read_dataset(path)
    for name in ("path", "name", "plant", "identity", "units", "holds", "signals"):
        assert getattr(opened, name) == getattr(whole, name)
    assert len(opened) == len(whole.records) == 3
    for one, other in zip(opened, whole.records, strict=True):
        assert one.signals.keys() == other.signals.keys()
        for name, values in other.signals.items():
            np.testing.assert_array_equal(one.signals[name], values)
        for name in ("name", "file", "period_s", "use", "repeat", "conditions", "initial", "ignore_first"):
            assert getattr(one, name) == getattr(other, name)


def test_what_a_manifest_tells_of_records_is_there_without_reading_them(
    oscillator: Write, tmp_path: Path
) -> None:
    opened = open_dataset(oscillator((RATE, THREE), t=T))
    (tmp_path / "r00.csv").unlink()
    assert [head.name for head in opened.heads] == ["r00_0-50", "r00_50-120", "whole"]
    assert [(head.use, head.repeat) for head in opened.heads] == [("fit", "A"), ("test", "A"), ("fit", None)]
    assert opened.heads[1].conditions == {"lid": "shut"}


def test_records_are_found_by_use_and_by_name(oscillator: Write) -> None:
    opened = open_dataset(oscillator((RATE, THREE), t=T))
    assert [record.name for record in opened.used_for("fit")] == ["r00_0-50", "whole"]
    assert opened.record("whole").initial == {"displacement": 0.5}
    with pytest.raises(KeyError, match='no record "hole"; did you mean "whole"'):
        opened.record("hole")


def test_nothing_of_a_record_is_kept(oscillator: Write) -> None:
    opened = open_dataset(oscillator())
    first, again = opened.record("r00"), opened.record("r00")
    assert first.signals["drive"] is not again.signals["drive"]
    np.testing.assert_array_equal(first.signals["drive"], again.signals["drive"])


def test_all_that_needs_no_numbers_is_told_on_opening(oscillator: Write) -> None:
    more = f"""{RATE}
rows = [0, 201]
[[records]]
file = "gone.csv"
{RATE}
[[records]]
file = "r00.csv"
name = "b"
{RATE}
ignore_first = 200
initial = {{ speed = 1.0 }}
[[records]]
file = "r00.csv"
name = "c"
time = "tt"
"""
    path = oscillator((RATE, more), t=T)
    with pytest.raises(InputError) as caught:
        open_dataset(path)
    lines = str(caught.value).splitlines()
    for part in (
        'records.0 "r00.csv": rows = [0, 201] ends after the file\'s 200 rows',
        'records.1 "gone.csv": no such file',
        'records.2 "r00.csv": unknown key "initial.speed"',
        'records.3 "r00.csv", key time: no column "tt"; did you mean "t"?',
    ):
        assert any(part in line for line in lines), part
    assert all(line.startswith(f"{path}: ") for line in lines)
    with pytest.raises(InputError) as whole:
        read_dataset(path)
    assert str(whole.value) == str(caught.value)


def test_numbers_that_are_wrong_are_told_when_their_record_is_read(
    oscillator: Write, shaker: dict[str, np.ndarray]
) -> None:
    values = shaker["x_tip"].copy()
    values[70] = np.nan
    path = oscillator((RATE, THREE), t=T, x_tip=values)
    opened = open_dataset(path)
    assert opened.record("r00_0-50").samples == 50
    with pytest.raises(InputError) as caught:
        opened.record("r00_50-120")
    text = 'records.1 "r00.csv": column "x_tip" is NaN in 1 of 70 rows: row 70 (counted from 0)'
    assert str(caught.value).startswith(f"{path}: {text}")
    assert opened.record("r00_0-50").samples == 50, "the finding is that record's alone"


def test_a_signal_that_no_file_has_is_told_on_opening(vo2: Write) -> None:
    change = ('unit = "mm"', 'unit = "mm"\ncolumn = "defelction"')
    with pytest.raises(InputError, match='did you mean "deflection"\\?; correct column'):
        open_dataset(vo2(change))


@pytest.mark.parametrize("read", [read_dataset, open_dataset])
def test_records_of_one_name_are_refused(
    oscillator: Write, read: Callable[[Path], Dataset | StoredDataset]
) -> None:
    twice = f'{RATE}\n[[records]]\nfile = "r00.csv"\n{RATE}'
    with pytest.raises(InputError, match='records need different names, "r00" appears twice'):
        read(oscillator((RATE, twice)))
