"""The table of the VO2 actuator's mechanisms is the registry."""

from __future__ import annotations

import re
from pathlib import Path

from rtctl.simulations.vo2 import MECHANISMS
from rtctl.simulations.vo2.mechanism import Vo2Mechanism

PAGE = Path(__file__).resolve().parents[2] / "docs" / "mechanisms-vo2.md"
TEXT = PAGE.read_text(encoding="utf-8")


def row(mechanism: Vo2Mechanism) -> str:
    """Of the page's table."""
    sentence = re.sub(r"\{(\w+)\}", r"*\1*", mechanism.statement)
    parameters = "; ".join(
        f"`{declared.name}` [{declared.unit}] {declared.meaning}{' (shape)' if declared.is_shape else ''}"
        for declared in mechanism.parameters
    )
    return f"| `{mechanism.id}` | {sentence} | {parameters} |"


def test_the_table_is_the_registry() -> None:
    table = [line for line in TEXT.splitlines() if re.match(r"\| `\w+\.\w+` \|", line)]
    expected = [row(mechanism) for mechanism in MECHANISMS.values()]
    assert table == expected, "the table of docs/mechanisms-vo2.md must be\n" + "\n".join(expected)


def test_the_files_that_the_page_points_to_exist() -> None:
    package = PAGE.parents[1] / "rtctl" / "simulations" / "vo2"
    named = re.findall(r"`([\w/]+\.py)`", TEXT)
    assert len(named) > 3
    for name in named:
        assert (package / name).exists() or (package / "mechanisms" / name).exists(), name
