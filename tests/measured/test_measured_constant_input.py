"""An input that no column has: `constant` of its signal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rtctl.border.errors import InputError
from rtctl.measured.reading import open_dataset, read_dataset


def manifest(folder: Path, drive: str, record: str = "sample_rate_hz = 100.0") -> Path:
    (folder / "r.csv").write_text("x\n" + "\n".join(str(0.1 * k) for k in range(20)) + "\n", encoding="utf-8")
    path = folder / "dataset.toml"
    path.write_text(
        '[dataset]\nname = "d"\nplant = "oscillator"\n'
        f'[signals.drive]\nrole = "input"\nunit = "mV"\n{drive}\n'
        '[signals.displacement]\nrole = "output"\nunit = "mm"\ncolumn = "x"\n'
        f'[[records]]\nfile = "r.csv"\nrows = [2, 12]\n{record}\n',
        encoding="utf-8",
    )
    return path


def test_it_has_its_value_in_every_row_of_a_record(tmp_path: Path) -> None:
    path = manifest(tmp_path, "constant = -2.5")
    for dataset in (read_dataset(path), open_dataset(path)):
        (record,) = dataset.used_for("fit")
        np.testing.assert_array_equal(record.signals["drive"], np.full(10, -2.5))
        assert list(record.signals) == ["drive", "displacement"]
        assert dataset.units["drive"] == "mV"


@pytest.mark.parametrize(
    ("drive", "record", "said"),
    [
        (
            'constant = 0.0\ncolumn = "u"',
            "sample_rate_hz = 100.0",
            "constant = 0 and column exclude each other",
        ),
        (
            'constant = 0.0\nhold = "zero"',
            "sample_rate_hz = 100.0",
            "constant = 0 and hold exclude each other",
        ),
        ("constant = nan", "sample_rate_hz = 100.0", "nan is not a finite number"),
        ("constant = 0.0", 'frequency = "x"', "of a sweep the drive has an amplitude"),
        ("", "sample_rate_hz = 100.0", 'no column "drive"'),
    ],
)
def test_what_contradicts_it_is_refused(tmp_path: Path, drive: str, record: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read_dataset(manifest(tmp_path, drive, record))


def test_an_output_is_measured(tmp_path: Path) -> None:
    path = manifest(tmp_path, "constant = 0.0")
    path.write_text(path.read_text().replace('column = "x"', "constant = 1.0"))
    with pytest.raises(InputError, match="constant = 1 is for inputs only"):
        read_dataset(path)


def test_a_drive_that_is_missing_is_told_with_what_to_write(tmp_path: Path) -> None:
    path = manifest(tmp_path, "constant = 0.0")
    text = path.read_text()
    start = text.index("[signals.drive]")
    path.write_text(text[:start] + text[text.index("[signals.displacement]") :])
    with pytest.raises(InputError, match=r"where nothing drives, with constant = 0\.0"):
        read_dataset(path)
