"""`rtctl identify --kind vo2` says where the static loops are too coarse, and only there."""

from __future__ import annotations

import json

import pytest
from coarse_cases import CELLS, dataset

from rtctl.cli import main
from rtctl.measured.writer import write_dataset


@pytest.mark.parametrize(("share", "notes"), [(0.3, 1), pytest.param(0.0, 0, marks=pytest.mark.slow)])
def test_domains_that_switch_as_one_are_noted(share, notes, tmp_path, capsys):
    film = dataset(share)
    path = write_dataset(tmp_path / "data", name="film", plant="vo2", records=film.records)
    out = tmp_path / "model.toml"
    few = ["--plays", "1", "--starts", "1", "--cells", str(CELLS), "--no-plot"]
    assert main(["identify", str(path), "--kind", "vo2", "--out", str(out), "--json", *few]) == 0
    found = json.loads(capsys.readouterr().out)["warnings"]
    assert len(found) == notes
    assert all(" um of the deflection instead of " in one and "rtctl diagnose" in one for one in found)
