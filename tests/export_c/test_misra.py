"""cppcheck with its MISRA addon finds nothing in an exported loop but what the page justifies."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from vo2_model_cases import simulation, small_model

from rtctl.api.exporting.c import export_c
from rtctl.models.vo2 import write_model

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "export-c.md").read_text(encoding="utf-8")


OBSERVER = {"estimator.kind": "observer", "controller.feedforward": "inverse"}
VO2 = ("observer", "composite", "gap_free", "preisach", "egpi")
LATE: dict[str, Any] = {"sensor__lag": {"time_constant": 2e-3}, "actuation__delay": {"delay": 2e-3}}


def exported(folder: Path, loop: str) -> None:
    """Write a loop: of an estimator of the small model, of that model with mechanisms, of a resonator or equations."""
    if loop in ("me_amplitude", "piezo_steps"):
        export_c(loop, out=folder)
        return
    model = folder.with_suffix(".toml")
    extended = loop.startswith("extended ")
    write_model(simulation(**LATE).model if extended else small_model(), model)
    settings = {**OBSERVER, "estimator.kind": loop.removeprefix("extended ")}
    export_c("steps", model=model, settings=settings, out=folder)


@pytest.mark.slow
@pytest.mark.parametrize(
    "loop", [*VO2, "extended observer", "extended composite", "me_amplitude", "piezo_steps"]
)
def test_every_deviation_stands_in_the_page(tmp_path: Path, loop: str) -> None:
    if shutil.which("cppcheck") is None:
        pytest.skip("cppcheck missing (Debian: cppcheck)")
    exported(tmp_path / "loop", loop)
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
