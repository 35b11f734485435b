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


def test_a_frequency_response_is_its_two_parts_beside_the_frequencies(tmp_path: Path) -> None:
    h = (K + 1.0) * np.exp(-0.01j * K)
    response = {"form": 6, "abscissa": 18, "increment": 0.5}
    write_uff(tmp_path / "r.uff", [uff58(h, id1="H1", **response), uff58(2.0 * h, id1="H2", **response)])
    assert list(open_table(tmp_path / "r.uff").columns) == [
        "frequency", "H1 in phase", "H1 quadrature", "H2 in phase", "H2 quadrature",
    ]  # fmt: skip
    read = TableCache()
    np.testing.assert_allclose(read.column(tmp_path / "r.uff", "frequency", "Hz"), 0.5 * K)
    np.testing.assert_allclose(
        read.column(tmp_path / "r.uff", "H2 quadrature", "um/V"), 2.0 * h.imag, rtol=1e-9
    )
    np.testing.assert_allclose(
        read.column(tmp_path / "r.uff", "H1 in phase", "um/V", 3, 7), h.real[3:7], rtol=1e-9
    )


def test_a_frequency_response_is_a_sweep(tmp_path: Path) -> None:
    h = (K + 1.0) * np.exp(-0.01j * K)
    write_uff(tmp_path / "r.uff", [uff58(h, id1="H", form=6, abscissa=18, increment=0.5, unit="um/V")])
    manifest = tmp_path / "dataset.toml"
    manifest.write_text(
        '[dataset]\nname = "hammer"\nplant = "oscillator"\n[signals.drive]\nrole = "input"\nunit = "V"\n'
        '[signals.displacement]\nrole = "output"\nunit = "um"\nin_phase = "H in phase"\n'
        'quadrature = "H quadrature"\nper_drive = true\n'
        '[[records]]\nfile = "r.uff"\nfrequency = "frequency"\nrows = [1, 200]\ndrive_amplitude = 0.5\n'
    )
    record = read_dataset(manifest).records[0]
    assert record.frequencies_hz[0] == 0.5
    np.testing.assert_allclose(record.complex_amplitudes("displacement"), 0.5 * h[1:], rtol=1e-9)


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
