"""What `rtctl simulate` prints and draws: scores a record, the picture of the worst one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.extras import can_draw
from rtctl.measured.repeats import deviation
from rtctl.measured.stored import StoredDataset
from rtctl.output.progress import print_table
from rtctl.session.model_validation import ComparedRecord

MOST_ROWS = 40


def print_comparison(summary: Mapping[str, Any], folder: Path) -> None:
    """The records with the largest errors, in the dataset's order where they are few."""
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
    print(f"results in {folder}; the worst record, {summary['worst']}, in {folder / 'worst.png'}")


def draw_worst(path: Path, worst: ComparedRecord, dataset: StoredDataset) -> None:
    """The picture of the worst record's worst output."""
    if not can_draw():
        return
    from rtctl.plots.comparison import Compared, plot_comparison

    record = worst.record
    output = max(
        worst.scores,
        key=lambda name: _order(worst.scores[name]._asdict() | {"nrmse": worst.scores[name].nrmse}),
    )
    plot_comparison(
        path,
        Compared(
            title=f"{dataset.name}, {record.name}",
            output=output,
            unit=dataset.units[output],
            time_s=record.period_s * np.arange(record.samples, dtype=np.float64),
            measured=record.signals[output],
            simulated=worst.simulated[output],
            ignore_first=record.ignore_first,
            noise=deviation(dataset, record, output),
        ),
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
