"""A comparison as a person reads it in a terminal: one row a record and output."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rtctl.api.comparison import Comparison
from rtctl.output.progress import say
from rtctl.output.readable_units import Scaled, readable, readable_unit
from rtctl.output.tables import print_table

MOST_ROWS = 40
"""Rows that are printed; the summary has all of them."""


def print_comparison(summary: Mapping[str, Any], folder: Path, *, drawn: bool) -> None:
    """Print the records with the largest errors, in the dataset's order where they are few.

    Args:
        summary: Content of `summary.json`.
        folder: Where the results are.
        drawn: Whether the folder has a picture of the worst record.
    """
    scored = [(row, name, score) for row in summary["records"] for name, score in row["outputs"].items()]
    shown = scored
    if len(scored) > MOST_ROWS:
        shown = sorted(scored, key=lambda one: -_order(one[2]))[:MOST_ROWS]
    units = _units_of(summary)
    print_table(
        "steady state of each row, no measured output fed in"
        if all(row["sample_rate_hz"] is None for row in summary["records"])
        else "free run from the first sample, no measured output fed in",
        [
            "record",
            "use",
            "output",
            "RMS error",
            "variation",
            "error of variation",
            "largest error",
            "integrator",
        ],
        [_row(row, name, score, units[name]) for row, name, score in shown],
    )
    if len(shown) < len(scored):
        print(f"{len(scored) - len(shown)} more, with smaller errors, in {folder / 'summary.json'}")
    for remark in summary.get("remarks", ()):
        print(f"note: {remark}")
    place = f", in {folder / 'worst.png'}" if drawn else ""
    print(f"results in {folder}; the worst record: {summary['worst']}{place}")


def warn_of_divergence(comparison: Comparison) -> None:
    """Print one line on standard error for each record whose simulation diverged."""
    for record, diverged_at_s in comparison.diverged.items():
        say(
            f"rtctl simulate: record {record} diverged {diverged_at_s:.6g} s after its first sample: the model has "
            "no bound there, or is no number; check the signs and units of its parameters",
            quiet=False,
        )


def _order(score: Mapping[str, Any]) -> float:
    if math.isinf(score["rms_error"]) or not score["rms_variation"]:
        return math.inf if math.isinf(score["rms_error"]) else 0.0
    return float(score["rms_error"] / score["rms_variation"])


def _share(score: Mapping[str, Any]) -> str:
    """Return the error in percent of how much the signal varies about its mean; "–" where nothing varies."""
    return f"{100 * score['rms_error'] / score['rms_variation']:.3g} %" if score["rms_variation"] else "–"


def _units_of(summary: Mapping[str, Any]) -> dict[str, Scaled]:
    """Return one unit for all errors of an output, which fits its largest signal."""
    sizes: dict[str, tuple[float, str]] = {}
    for row in summary["records"]:
        for name, score in row["outputs"].items():
            size = max(score["rms_variation"] or 0.0, sizes.get(name, (0.0, ""))[0])
            sizes[name] = (size, score["unit"])
    return {name: readable_unit(size, unit) for name, (size, unit) in sizes.items()}


def _row(row: Mapping[str, Any], name: str, score: Mapping[str, Any], unit: Scaled) -> list[str]:
    if row["diverged_at_s"] is not None:
        error = [
            f"diverged at {readable(row['diverged_at_s'], 's')}",
            unit.text(score["rms_variation"]),
            "–",
            "–",
            "–",
        ]
    else:
        error = [
            unit.text(score["rms_error"]), unit.text(score["rms_variation"]), _share(score),
            unit.text(score["max_error"]), f"{100 * score['integrator_error']:.1g} %",
        ]  # fmt: skip
    return [row["record"], row["use"], name, *error]
