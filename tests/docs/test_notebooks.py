"""The notebooks run in an empty folder, and show what is stored in them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "notebooks"
NOTEBOOKS = sorted(path.stem for path in FOLDER.glob("*.ipynb"))


def test_there_are_notebooks() -> None:
    assert {"oscillator", "own_parts", "vo2_loop"} <= set(NOTEBOOKS)


@pytest.mark.slow  # their kernel imports half a minute of modules, and the tutorials show the same
@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_runs_and_shows_the_same_kinds_of_outputs(name: str) -> None:
    pytest.importorskip("nbclient")
    command = [sys.executable, str(FOLDER / "make.py"), "--check", name]
    environment = {**os.environ, "JUPYTER_PLATFORM_DIRS": "1"}
    ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=900, env=environment)
    assert ended.returncode == 0, ended.stderr
