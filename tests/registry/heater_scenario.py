"""A scenario of the user's heater."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rtctl.cli import main

TEXT = """
[scenario]
title = "heater steps"
plant = "heater"
period = "1 ms"
duration = "1 s"
[driver]
device = "heater"
[limits]
low = "0 V"
high = "8 V"
sensed_low = "-1 K"
sensed_high = "50 K"
[reference]
kind = "steps"
levels = ["10 K", "25 K"]
hold = "500 ms"
[controller]
kind = "integral"
[checks]
tracking_mean_percent = 20.0
"""


def scenario_file(folder: Path, text: str = TEXT) -> Path:
    """Write the scenario and return its path."""
    path = folder / "heater.toml"
    path.write_text(text)
    return path


def run(folder: Path, *options: str, text: str = TEXT) -> tuple[int, dict[str, Any] | None]:
    """Return the exit code of `rtctl run` and the summary, None where it wrote none."""
    file, out = str(scenario_file(folder, text)), str(folder / "out")
    code = main(["run", file, "--out", out, "--quiet", "--no-plot", *options])
    summary = folder / "out" / "summary.json"
    return code, json.loads(summary.read_text()) if summary.is_file() else None
