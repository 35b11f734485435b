"""The page on models in other programs runs as it stands."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "export-fmu.md").read_text(encoding="utf-8")


def test_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    monkeypatch.chdir(tmp_path)
    said = io.StringIO()
    names: dict[str, object] = {"__name__": "page"}
    with contextlib.redirect_stdout(said):
        for block in re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL):
            exec(compile(block, "export-fmu.md", "exec"), names)
    method, _, _, poles = said.getvalue().splitlines()[:4]
    assert method.startswith("Runge-Kutta of order 4 ('time', 'drive', 'drive_slope', 'displacement')")
    assert "j" in poles
    assert (tmp_path / "beam.fmu").exists()
    assert (tmp_path / "voice_coil.m").exists()
