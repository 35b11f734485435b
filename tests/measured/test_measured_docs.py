"""The page on datasets is true: its example loads, its code runs, and it names every format."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from rtctl.measured import read_dataset
from rtctl.measured.readers import READERS

PAGE = (Path(__file__).parents[2] / "docs" / "datasets.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return [str(text) for text in re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)]


def test_the_example_loads_and_the_code_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    k = np.arange(16_000)
    columns = np.column_stack([np.sin(0.1 * k), np.cos(0.1 * k)])
    np.savetxt(tmp_path / "r00.csv", columns, delimiter=",", header="drive,x_tip", comments="")
    path = tmp_path / "dataset.toml"
    path.write_text(blocks("toml")[0], encoding="utf-8")
    (record,) = read_dataset(path).records
    assert record.initial == {"displacement": 0.5, "velocity": 0.0}
    exec(blocks("python")[0], {"path": path})
    assert capsys.readouterr().out.startswith("r00 16000 0.70")


def test_the_example_of_a_sweep_loads(tmp_path: Path) -> None:
    k = np.arange(200.0)
    columns = np.column_stack([100.0 + k, np.cos(0.01 * k), -np.sin(0.01 * k)])
    np.savetxt(tmp_path / "up.csv", columns, delimiter=",", header="f,X,Y", comments="")
    path = tmp_path / "dataset.toml"
    heading = '[dataset]\nname = "resonator"\nplant = "oscillator"\n'
    path.write_text(heading + blocks("toml")[1], encoding="utf-8")
    (record,) = read_dataset(path).records
    np.testing.assert_allclose(record.complex_amplitudes("displacement"), np.exp(-0.01j * k))
    assert record.signals["drive"][0] == 0.2


def test_every_format_is_on_the_page() -> None:
    rows = "".join(line.split("|")[1] for line in PAGE.splitlines() if line.startswith("| `."))
    assert set(re.findall(r"`([.\w]+)`", rows)) == set(READERS)
