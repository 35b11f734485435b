"""Draw docs/pictures/diagnosis-method.png, the flow chart of docs/diagnosis-method.md."""

from __future__ import annotations

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

PICTURE = Path(__file__).resolve().parents[1] / "docs" / "pictures" / "diagnosis-method.png"
STEP, TEST, ANSWER = "#dbe9f6", "#fde8d0", "#e3f1de"
WIDTH, HEIGHT = 4.2, 0.8
BOXES = {
    "data": (0.0, 9.0, "records and model", STEP),
    "screening": (0.0, 7.8, "1  screening\nchecks, spikes, unknown initial state", STEP),
    "nominal": (0.0, 6.6, "2  nominal fit\nsegments, then free runs", STEP),
    "tests": (0.0, 5.4, "3  residual tests\nof the nominal model", TEST),
    "search": (0.0, 4.2, "4  stepwise search: propose, fit,\nrank, test, refit rivals", TEST),
    "nonparametric": (0.0, 3.0, "5  nonparametric alternatives", TEST),
    "holdout": (0.0, 1.8, "6  verification on test records", TEST),
    "adequate": (6.2, 5.4, "7  adequate, or one value\nof the file is wrong", ANSWER),
    "unexplained": (6.2, 3.0, "7  unexplained: where the\nresidual lives", ANSWER),
    "explained": (6.2, 1.8, "7  explained or partly explained:\ncauses with intervals", ANSWER),
    "experiment": (
        6.2,
        0.6,
        "8  extended model, gain, report; next\nexperiment if several sets are left",
        STEP,
    ),
}
DOWN = [
    ("data", "screening", ""),
    ("screening", "nominal", ""),
    ("nominal", "tests", ""),
    ("tests", "search", "fails"),
    ("search", "nonparametric", "best set"),
    ("nonparametric", "holdout", "set is best"),
    ("explained", "experiment", ""),
]
RIGHT = [
    ("tests", "adequate", "passes"),
    ("nonparametric", "unexplained", "fits better"),
    ("holdout", "explained", "confirmed"),
]


def draw(axes: Axes) -> None:
    """Draw boxes, then arrows with their conditions."""
    for x, y, text, color in BOXES.values():
        axes.text(
            x, y, text, ha="center", va="center", fontsize=10, linespacing=1.35,
            bbox={"boxstyle": "round,pad=0.1", "facecolor": "none", "edgecolor": "none"},
        )  # fmt: skip
        axes.add_patch(_box(x, y, color))
    arrow = {"arrowstyle": "-|>", "color": "#444444", "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0}
    for start, end, condition in DOWN:
        (x, y, *_), (_, below, *_) = BOXES[start], BOXES[end]
        axes.annotate("", (x, below + HEIGHT / 2), (x, y - HEIGHT / 2), arrowprops=arrow)
        axes.text(x + 0.1, (y + below) / 2, condition, va="center", fontsize=9, color="#444444")
    for start, end, condition in RIGHT:
        (x, y, *_), (right, *_) = BOXES[start], BOXES[end]
        axes.annotate("", (right - WIDTH / 2, y), (x + WIDTH / 2, y), arrowprops=arrow)
        axes.text((x + right) / 2, y + 0.12, condition, ha="center", va="bottom", fontsize=9, color="#444444")
    (x, y, *_), (right, above, *_) = BOXES["holdout"], BOXES["unexplained"]
    axes.annotate("", (right - WIDTH / 2, above - 0.25), (x + WIDTH / 2, y + 0.25), arrowprops=arrow)
    axes.text(x + WIDTH / 2 + 0.15, y + 0.78, "contradicted", ha="left", fontsize=9, color="#444444")


def _box(x: float, y: float, color: str) -> FancyBboxPatch:
    return FancyBboxPatch(
        (x - WIDTH / 2, y - HEIGHT / 2), WIDTH, HEIGHT, boxstyle="round,pad=0,rounding_size=0.12",
        facecolor=color, edgecolor="#444444", linewidth=1.0, zorder=0.5,
    )  # fmt: skip


def main() -> None:
    """Write the picture."""
    figure = Figure(figsize=(8.6, 8.0), dpi=120)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(-2.4, 8.6), ylim=(0.0, 9.6))
    axes.set_axis_off()
    draw(axes)
    figure.savefig(PICTURE)


if __name__ == "__main__":
    main()
