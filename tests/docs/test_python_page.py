"""The blocks of the page on Python and the one in the README run as they stand."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def blocks_of(page: Path) -> list[str]:
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL)


def printed_by(page: Path) -> str:
    """What all blocks of a page print, run one after the other in one namespace."""
    said = io.StringIO()
    names: dict[str, object] = {"__name__": "page"}
    with contextlib.redirect_stdout(said):
        for number, block in enumerate(blocks_of(page)):
            exec(compile(block, f"{page.name}, block {number}", "exec"), names)
    return said.getvalue()


@pytest.mark.slow
def test_the_page_on_python_runs_and_names_the_hidden_spring(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    said = printed_by(ROOT / "docs" / "python.md")
    assert "explained\n" in said
    assert "stiffness.quintic: The restoring force" in said
    assert 'stepz: no such scenario file; did you mean "steps"?' in said
    assert (tmp_path / "answer" / "report.html").is_file()
    assert (tmp_path / "stretch.png").stat().st_size > 20_000


def test_the_readme_shows_ten_lines_that_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (block,) = blocks_of(ROOT / "README.md")
    assert 8 <= len(block.splitlines()) <= 12
    monkeypatch.chdir(tmp_path)
    said = printed_by(ROOT / "README.md")
    assert "explained" in said
    assert "fifth order" in said


def test_links_of_the_page_lead_somewhere() -> None:
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    targets = re.findall(r"\]\(([^)#]+)\)", text)
    assert targets
    assert [target for target in targets if not (ROOT / "docs" / target).exists()] == []
