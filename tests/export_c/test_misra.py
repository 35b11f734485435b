"""cppcheck with its MISRA addon finds nothing in an exported loop but what the page justifies."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from vo2_model_cases import small_model

from rtctl.api.exporting.c import export_c
from rtctl.models.vo2 import write_model

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "export-c.md").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("estimator", ["observer", "composite", "gap_free", "preisach", "egpi"])
def test_every_deviation_stands_in_the_page(tmp_path: Path, estimator: str) -> None:
    if shutil.which("cppcheck") is None:
        pytest.skip("cppcheck missing (Debian: cppcheck)")
    write_model(small_model(), tmp_path / "model.toml")
    settings = {"estimator.kind": estimator, "controller.feedforward": "inverse"}
    export_c("steps", model=tmp_path / "model.toml", settings=settings, out=tmp_path / "loop")
    # cppcheck does not see that a view, passed by value, points to memory of the state
    blind = ["--suppress=unreadVariable", "--suppress=returnDanglingLifetime"]
    command = [
        "cppcheck",
        "--std=c99",
        "--enable=warning,performance,portability,style",
        "--addon=misra",
        "-q",
        "-I.",
    ]
    checked = subprocess.run(
        [*command, *blind, "rtctl.c"],
        cwd=tmp_path / "loop", capture_output=True, text=True, check=True,
    )  # fmt: skip
    found = set(re.findall(r"\[(?:misra-c2012-)?([\w.]+)\]$", checked.stderr, flags=re.MULTILINE))
    table = PAGE.split("## MISRA C")[1]
    justified = set(
        re.findall(
            r"\b(\d+\.\d+)\b", " ".join(line.split("|")[1] for line in table.splitlines() if "|" in line)
        )
    )
    assert found, "cppcheck did not run its addon"
    assert found - justified == set()
