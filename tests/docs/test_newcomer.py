"""What somebody who has only a file finds on the README and the tutorial."""

from __future__ import annotations

import re
from pathlib import Path

from rtctl.cli.printing.diagnosis import UNDECIDED, VERDICTS

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def anchor_of(heading: str) -> str:
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def test_the_two_commands_for_a_file_stand_near_the_top() -> None:
    top = README.splitlines()[:40]
    commands = [line.split()[:2] for line in top if line.startswith("rtctl ")]
    assert commands[:2] == [["rtctl", "init"], ["rtctl", "diagnose"]]
    assert any("minutes" in line for line in top)


def test_the_contents_lead_to_headings() -> None:
    headings = {anchor_of(one) for one in re.findall(r"^## (.*)$", README, re.MULTILINE)}
    linked = re.findall(r"\]\(#([\w-]+)\)", README)
    assert len(linked) > 5
    assert [one for one in linked if one not in headings] == []


def test_the_tutorial_has_every_verdict_that_the_command_prints() -> None:
    text = (ROOT / "docs" / "diagnosis.md").read_text(encoding="utf-8")
    table = text.partition("verdicts\n")[2].partition("\n\n**When")[0]
    rows = re.findall(r"^\| `?(\w+)`? \|", table, re.MULTILINE)[1:]
    assert rows == [*VERDICTS, UNDECIDED.partition(":")[0].lower()]
    assert "## Five answers, four verdicts" in text
