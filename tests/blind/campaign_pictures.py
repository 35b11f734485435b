"""Two pictures of a campaign: how often a stated probability is true, and how often an effect of some size is named."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from details import calibration, hits
from rates import Line, Rate

COLOURS = {"oscillator": "#1f5fa8", "vo2": "#c2571a"}
MARKS = {"oscillator": "o", "vo2": "s"}
ASIDE = 0.008  # of the probability, between the marks of two plants


def draw(lines: Sequence[Line], folder: Path) -> list[Path]:
    """`reliability.png` and `hits.png` into `folder`."""
    return [_reliability(lines, folder / "reliability.png"), _hits(lines, folder / "hits.png")]


def _plants(lines: Sequence[Line]) -> dict[str, list[Line]]:
    return {plant: [x for x in lines if x["plant"] == plant] for plant in COLOURS}


def _bars(rates: Sequence[Rate]) -> np.ndarray:
    bars = np.array([[r.share - r.interval[0], r.interval[1] - r.share] for r in rates]).T
    return np.maximum(bars, 0.0)  # at 0 and 1 the interval ends there, but for rounding


def _reliability(lines: Sequence[Line], path: Path) -> Path:
    figure, axes = plt.subplots(figsize=(5.2, 4.6), layout="constrained")
    axes.plot([0, 1], [0, 1], color="0.6", lw=1, label="calibrated")
    for plant, own in _plants(lines).items():
        bins = calibration(own)
        if bins:
            first = plant == "oscillator"  # each plant's marks and counts beside the other's, not over them
            stated, rates = [one[0] + (-ASIDE if first else ASIDE) for one in bins], [one[1] for one in bins]
            axes.errorbar(stated, [r.share for r in rates], _bars(rates), fmt=MARKS[plant], color=COLOURS[plant],
                          capsize=3, label=plant)  # fmt: skip
            for x, r in zip(stated, rates, strict=True):
                axes.annotate(f"{r.total}", (x, r.interval[0 if first else 1]), (0, -11 if first else 4),
                              textcoords="offset points", ha="center", fontsize=8, color=COLOURS[plant])  # fmt: skip
    axes.set(xlabel="stated probability of a named cause", ylabel="share that is true", xlim=(-0.02, 1.05),
             ylim=(-0.05, 1.09))  # fmt: skip
    axes.set_title("Stated probabilities (95 % Wilson intervals, number of causes)", fontsize=10)
    axes.legend(loc="upper left", frameon=False)
    return _saved(figure, path)


def _hits(lines: Sequence[Line], path: Path) -> Path:
    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    for plant, own in _plants(lines).items():
        bins = hits(own)
        if bins:
            low, high, rates = (list(column) for column in zip(*bins, strict=True))
            middle = np.sqrt(np.maximum(low, 1e-3) * np.maximum(high, 1e-3))
            axes.errorbar(middle, [r.share for r in rates], _bars(rates), fmt=MARKS[plant], color=COLOURS[plant],
                          capsize=3, label=plant)  # fmt: skip
            axes.hlines([r.share for r in rates], low, high, color=COLOURS[plant], lw=1, alpha=0.5)
            for x, r in zip(middle, rates, strict=True):
                axes.annotate(f"{r.total}", (x, r.share), (5, -12), textcoords="offset points", fontsize=8,
                              color=COLOURS[plant])  # fmt: skip
    axes.axvline(0.1, color="0.6", lw=1, ls="--")
    axes.set(xscale="log", ylim=(-0.02, 1.04), ylabel="named right, alone or in a set of two",
             xlabel="rms that the re-fitted nominal model misses, over the noise's rms")  # fmt: skip
    axes.set_title("One or two hidden effects (95 % Wilson intervals, number of cases)", fontsize=10)
    axes.legend(loc="lower right", frameon=False)
    return _saved(figure, path)


def _saved(figure: plt.Figure, path: Path) -> Path:
    figure.savefig(path, dpi=130)
    plt.close(figure)
    return path
