"""A second acquisition into the same folder keeps the first one's data."""

from __future__ import annotations

from pathlib import Path

from rtctl.cli import main
from rtctl.measured import read_dataset
from rtctl.measured.backup import put_aside

SCENARIO = """
[scenario]
title = "short"
plant = "vo2"
period = "1 ms"
[[excitation]]
kind = "levels"
use = "fit"
hold = "10 ms"
levels = ["0 %", "{high} %", "40 %"]
times = 10
"""


def test_where_there_is_none_nothing_is_moved(tmp_path: Path) -> None:
    assert put_aside(tmp_path) is None
    assert list(tmp_path.iterdir()) == []


def test_records_elsewhere_stay_where_they_are(tmp_path: Path) -> None:
    folder = tmp_path / "set"
    folder.mkdir()
    for file in (tmp_path / "far.csv", folder / "near.csv", folder / "notes.txt"):
        file.write_text("x\n1\n")
    (folder / "dataset.toml").write_text('[[records]]\nfile = "../far.csv"\n[[records]]\nfile = "near.csv"\n')
    first, _ = put_aside(folder), (folder / "dataset.toml").write_text("[[records]]\n")
    second = put_aside(folder)
    assert first is not None
    assert second not in (None, first)
    assert sorted(one.name for one in first.iterdir()) == ["dataset.toml", "near.csv"]
    assert (tmp_path / "far.csv").exists()
    assert (folder / "notes.txt").exists()


def test_records_of_a_manifest_that_cannot_be_read_are_kept_too(tmp_path: Path) -> None:
    (tmp_path / "dataset.toml").write_text("[[records]\n")
    (tmp_path / "r00-levels.parquet").write_bytes(b"measured")
    aside = put_aside(tmp_path)
    assert aside is not None
    assert sorted(one.name for one in aside.iterdir()) == ["dataset.toml", "r00-levels.parquet"]


def test_a_second_acquisition_keeps_the_first(tmp_path: Path) -> None:
    scenario, folder = tmp_path / "short.toml", tmp_path / "set"
    commands = []
    for high in (60, 80):
        scenario.write_text(SCENARIO.format(high=high))
        assert (
            main(
                ["acquire", str(scenario), "--out", str(folder), "--set", "driver.kind=inprocess", "--quiet"]
            )
            == 0
        )
        commands.append(read_dataset(folder / "dataset.toml").records[0].signals["current"].max())
    (aside,) = folder.glob("before-*")
    assert (
        read_dataset(aside / "dataset.toml").records[0].signals["current"].max() == commands[0] < commands[1]
    )
