"""pint's definitions on the disk: used where they are good, done without where they are not."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from rtctl.border.units import quantities


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setattr(quantities, "_KEPT", tmp_path / "pint")
    quantities.unit_registry.cache_clear()
    yield tmp_path / "pint"
    quantities.unit_registry.cache_clear()


def again() -> float:
    quantities.unit_registry.cache_clear()
    return quantities.convert(1.0, "ms", "s")


def test_the_second_registry_is_read_from_the_disk(kept: Path) -> None:
    assert again() == 1e-3
    files = {one: one.stat().st_mtime_ns for one in kept.glob("*.pickle")}
    assert files
    assert again() == 1e-3
    assert {one: one.stat().st_mtime_ns for one in kept.glob("*.pickle")} == files


@pytest.mark.parametrize("damage", [b"", b"\x80\x05K", b"no pickle"])
def test_damaged_definitions_are_done_without(kept: Path, damage: bytes) -> None:
    again()
    for one in kept.glob("*.pickle"):
        one.write_bytes(damage)
    assert again() == 1e-3


def test_where_there_is_no_place_units_are_read_all_the_same(kept: Path) -> None:
    kept.write_text("a file where the folder should be")
    assert again() == 1e-3
