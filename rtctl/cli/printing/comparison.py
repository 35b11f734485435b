"""A comparison as a person reads it in a terminal: one row a record and output."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.api.comparison import Comparison
from rtctl.output.progress import print_table, say

MOST_ROWS = 40
"""Rows that are printed; the summary has all of them."""


def print_comparison(summary: Mapping[str, Any], folder: Path) -> None:
    """Print the records with the largest errors, in the dataset's order where they are few."""
    scored = [(row, name, score) for row in summary["records"] for name, score in row["outputs"].items()]
    shown = scored
    if len(scored) > MOST_ROWS:
        shown = sorted(scored, key=lambda one: -_order(one[2]))[:MOST_ROWS]
    print_table(
        "free run from the first sample, no measured output fed in",
        [
            "record",
            "use",
            "output",
            "RMS error",
            "RMS signal",
            "error/signal",
            "largest error",
            "of it integrator",
        ],
        [_row(row, name, score) for row, name, score in shown],
    )
    if len(shown) < len(scored):
        print(f"{len(scored) - len(shown)} more, with smaller errors, in {folder / 'summary.json'}")
    for remark in summary.get("remarks", ()):
        print(f"note: {remark}")
    print(f"results in {folder}; the worst record, {summary['worst']}, in {folder / 'worst.png'}")


def warn_of_divergence(comparison: Comparison) -> None:
    """Print one line on standard error for each record whose simulation diverged."""
    for record, diverged_at_s in comparison.diverged.items():
        say(
            f"rtctl simulate: record {record} diverged {diverged_at_s:.6g} s after its first sample: the model has "
            "no bound there; check the signs and units of its stiffnesses",
            quiet=False,
        )


def _order(score: Mapping[str, Any]) -> float:
    return math.inf if math.isinf(score["rms_error"]) else float(np.nan_to_num(score["nrmse"]))


def _row(row: Mapping[str, Any], name: str, score: Mapping[str, Any]) -> list[str]:
    unit = score["unit"]
    if row["diverged_at_s"] is not None:
        error = [
            f"diverged at {row['diverged_at_s']:.4g} s",
            f"{score['rms_signal']:.4g} {unit}",
            "–",
            "–",
            "–",
        ]
    else:
        error = [
            f"{score['rms_error']:.4g} {unit}", f"{score['rms_signal']:.4g} {unit}", f"{100 * score['nrmse']:.3g} %",
            f"{score['max_error']:.4g} {unit}", f"{100 * score['integrator_error']:.1g} %",
        ]  # fmt: skip
    return [row["record"], row["use"], name, *error]
