"""Pages that are generated are up to date, links lead somewhere, and every page stands in the site's navigation."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

import pytest

import rtctl

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
sys.path.insert(0, str(ROOT / "benchmarks"))
from thresholds_table import thresholds_page  # noqa: E402


def test_the_table_of_thresholds_is_that_of_the_source() -> None:
    expected = thresholds_page()
    assert (DOCS / "thresholds.md").read_text(encoding="utf-8") == expected, "run `make thresholds`"


@pytest.mark.parametrize("page", PAGES, ids=[str(page.relative_to(DOCS)) for page in PAGES])
def test_links_and_pictures_of_a_page_exist(page: Path) -> None:
    targets = re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text(encoding="utf-8"))
    local = [target for target in targets if "://" not in target]
    assert [target for target in local if not (page.parent / target).exists()] == []


def test_every_page_stands_in_the_navigation() -> None:
    navigation = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").split("\nnav:\n")[1]
    listed = set(re.findall(r"(\S+\.md)$", navigation, flags=re.MULTILINE))
    assert listed == {str(page.relative_to(DOCS)) for page in PAGES}


def test_source_files_that_pages_name_exist() -> None:
    missing = []
    for page in [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md"]:
        for name in re.findall(
            r"`((?:rtctl|plant_sim|drivers|tests|benchmarks|scenarios)/[\w./-]+)`", page.read_text()
        ):
            if not (ROOT / name).exists():
                missing.append(f"{page.relative_to(ROOT)}: {name}")
    assert missing == []


def test_the_version_is_the_same_everywhere() -> None:
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    cited = re.search(r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)
    changed = re.search(
        r"^## (\S+) \((\S+)\)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert cited is not None
    assert changed is not None
    assert {declared, cited[1], changed[1], rtctl.__version__} == {declared}
    assert f'date-released: "{changed[2]}"' in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_make_targets_that_pages_and_workflows_name_exist() -> None:
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    users = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / ".github" / "workflows").glob("*.yml")]
    text = "\n".join(path.read_text(encoding="utf-8") for path in users)
    named = {
        name
        for line in re.findall(r"(?:run: |`|^)make ((?:[a-z]+ ?)+)", text, re.MULTILINE)
        for name in line.split()
    }
    assert {"test", "run", "docs", "minimal"} <= named & targets
    assert named <= targets | {"PYTHON"}
