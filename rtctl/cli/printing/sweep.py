"""A campaign's summary as a person reads it in a terminal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rtctl.output.tables import print_table


def print_sweep(summary: Mapping[str, Any], folder: Path) -> None:
    """Print how many trajectories there are of each kind, and the least errors."""
    rows = [[key, f"{count:,}"] for key, count in summary.get("kind", {}).items()]
    rows += [[f"least error: {key}", f"{value:.6g}"] for key, value in summary.get("least", {}).items()]
    rows.append(["all", f"{summary['trajectories']:,}"])
    parts = summary["parts"]
    title = (
        f"{summary['title']} ({summary['wall_s']:.1f} s, {parts['computed']} of {parts['all']} parts computed, "
        f"the rest found in {folder})"
    )
    print_table(title, ["", "trajectories"], rows)
