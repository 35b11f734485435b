"""The page on datasets is true: its example loads, its code runs, and it names every format."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from rtctl.measured import read_dataset
from rtctl.measured.readers import READERS

PAGE = (Path(__file__).parents[2] / "docs" / "datasets.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    (text,) = re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)
    return str(text)


def test_the_example_loads_and_the_code_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    k = np.arange(16_000)
    columns = np.column_stack([np.sin(0.1 * k), np.cos(0.1 * k)])
    np.savetxt(tmp_path / "r00.csv", columns, delimiter=",", header="drive,x_tip", comments="")
    path = tmp_path / "dataset.toml"
    path.write_text(block("toml"), encoding="utf-8")
    (record,) = read_dataset(path).records
    assert record.initial == {"displacement": 0.5, "velocity": 0.0}
    exec(block("python"), {"path": path})
    assert capsys.readouterr().out.startswith("r00 16000 0.70")


def test_every_format_is_on_the_page() -> None:
    rows = "".join(line.split("|")[1] for line in PAGE.splitlines() if line.startswith("| `."))
    assert set(re.findall(r"`([.\w]+)`", rows)) == set(READERS)
