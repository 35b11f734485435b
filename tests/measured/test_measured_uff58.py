"""UFF 58: functions by their id line or response, unit and abscissa against the manifest's."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from measured_files import uff58, write_uff

from rtctl.border.errors import InputError
from rtctl.measured import open_dataset, read_dataset
from rtctl.measured.columns.conversion import TableCache
from rtctl.measured.readers import open_table

Write = Callable[..., Path]
FILE = ('"r00.csv"', '"r00.uff"')
K = np.arange(200.0)


@pytest.mark.parametrize(
    ("functions", "names"),
    [
        ([{"id1": "x tip"}, {"id1": "drive"}], ["x tip", "drive"]),
        ([{"node": 12, "direction": 3}, {"node": 12, "direction": -1}], ["12:+Z", "12:-X"]),
        ([{"node": 4, "direction": 5}, {"node": 4, "direction": 0}], ["4:+RY", "4:S"]),
        ([{"id1": "run", "node": 1}, {"id1": "run", "node": 2}, {"id1": "u"}], ["run 1:+Z", "run 2:+Z", "u"]),
        ([{"id1": "run"}, {"id1": "u"}, {"id1": "run"}], ["run 1:+Z #1", "u", "run 1:+Z #3"]),
        ([{}, {}], ["1:+Z #1", "1:+Z #2"]),
    ],
)
def test_names_tell_functions_apart(
    tmp_path: Path, functions: list[dict[str, Any]], names: list[str]
) -> None:
    path = tmp_path / "r.uff"
    write_uff(path, [uff58(K + k, **function) for k, function in enumerate(functions)])
    assert list(open_table(path).columns) == names
    for k, name in enumerate(names):
        np.testing.assert_array_equal(TableCache().column(path, name, "V"), K + k)


def test_the_names_are_in_the_message_about_one_that_is_not(tmp_path: Path) -> None:
    write_uff(tmp_path / "r.uff", [uff58(K, node=12), uff58(K, id1="drive")])
    with pytest.raises(ValueError, match=r'no column "x_tip"; known: 12:\+Z, drive'):
        TableCache().column(tmp_path / "r.uff", "x_tip", "V")


def test_single_precision_arrives(tmp_path: Path) -> None:
    write_uff(tmp_path / "r.uff", [uff58(K / 7.0, id1="x", form=2)])
    np.testing.assert_allclose(TableCache().column(tmp_path / "r.uff", "x", "V"), K / 7.0, rtol=1e-5)


def write_pair(folder: Path, **of_x_tip: Any) -> None:
    write_uff(folder / "r00.uff", [uff58(K, id1="drive"), uff58(K, id1="x_tip", **of_x_tip)])


def test_the_units_label_is_held_against_the_manifest(oscillator: Write, tmp_path: Path) -> None:
    write_pair(tmp_path, unit="um")
    with pytest.raises(InputError, match='the file states unit "um" for column "x_tip", the manifest "mm"'):
        open_dataset(oscillator(FILE))
    write_pair(tmp_path, unit="mm")
    assert read_dataset(oscillator(FILE)).records[0].samples == 200


@pytest.mark.parametrize(
    ("increment", "unit", "stated"),
    [
        (1e-3, "NONE", None),
        (1.0, "ms", None),
        (1.0005e-3, "s", None),
        (2e-3, "NONE", "500 Hz"),
        (2.0, "ms", "500 Hz"),
        (0.0, "NONE", None),
    ],
)
def test_the_abscissa_is_held_against_the_rate(
    oscillator: Write, tmp_path: Path, increment: float, unit: str, stated: str | None
) -> None:
    write_pair(tmp_path, increment=increment, abscissa_unit=unit)
    path = oscillator(FILE)
    if stated is None:
        assert read_dataset(path).records[0].period_s == 1e-3
    else:
        with pytest.raises(InputError) as caught:
            open_dataset(path)
        assert f'the file states {stated} for column "x_tip" (abscissa increment = 0.002 s)' in str(
            caught.value
        )


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (
            uff58(K + 0j, id1="x", form=6),
            'column "x" holds complex numbers, real numbers are needed; export the',
        ),
        (uff58(K, id1="x", spacing=0), 'column "x" has uneven abscissa spacing .* resample it and export it'),
        (uff58(K, id1="x", abscissa=18), 'column "x" is a function of frequency, one of time is needed'),
        (uff58(K, id1="x", abscissa=8), 'column "x" is a function of data type 8, one of time is needed'),
    ],
)
def test_functions_that_are_no_signal(tmp_path: Path, function: bytes, message: str) -> None:
    write_uff(tmp_path / "r.uff", [function])
    with pytest.raises(ValueError, match=message):
        TableCache().length(tmp_path / "r.uff", "x", "V")


def test_a_function_with_fewer_values_than_it_says(tmp_path: Path) -> None:
    write_uff(tmp_path / "r.uff", [uff58(K, id1="x", points=300)])
    with pytest.raises(ValueError, match='column "x" ends after 200 of 300 values: damaged'):
        TableCache().column(tmp_path / "r.uff", "x", "V")


def test_a_universal_file_without_functions(tmp_path: Path) -> None:
    write_uff(tmp_path / "r.uff", [])
    with pytest.raises(ValueError, match="holds no dataset 58"):
        open_table(tmp_path / "r.uff")
