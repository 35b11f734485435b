"""The look of the figures neither depends on the user's settings nor changes them, and headlines fit."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from rtctl.plots.elements.style import HouseFigure, headline, house_style, new_figure
from rtctl.plots.scenarios import plot_scenarios


@pytest.mark.parametrize("length", [20, 100, 160])
def test_headlines_of_any_length_stay_within_the_figure(length: int) -> None:
    with house_style():
        figure = new_figure(11.5, 4.0)
        figure.add_subplot()
        headline(figure, "tracks to % " * (length // 12), "error mean " * (length // 11))
        figure.draw_without_rendering()
        for text in figure.texts:
            assert text.get_window_extent().x1 < figure.bbox.x1


def test_the_users_matplotlib_settings_neither_change_nor_matter(tmp_path: Path) -> None:
    rows = [("1 s steps", 0.8, 1.95)]
    plot_scenarios(tmp_path / "plain.png", rows)
    with mpl.rc_context({"font.size": 31.0, "axes.facecolor": "red", "savefig.dpi": 20}):
        plot_scenarios(tmp_path / "odd.png", rows)
        assert mpl.rcParams["font.size"] == 31.0
    assert (tmp_path / "plain.png").read_bytes() == (tmp_path / "odd.png").read_bytes()


def test_figures_are_drawn_without_pyplot() -> None:
    question = "import sys, rtctl.plots; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", question], check=False).returncode == 0


def test_drawing_once_gives_the_same_bytes_as_matplotlib() -> None:
    drawn = []
    for save in (Figure.savefig, HouseFigure.savefig):
        with house_style():
            figure = new_figure(6.0, 4.0)
            for axes, top in zip(figure.subplots(2, 2).flat, (1.0, 10.0, 1e3, 1e-6), strict=True):
                axes.plot(np.linspace(0.0, 1.0, 50), np.linspace(0.0, top, 50))
                axes.set_ylabel("deflection [um]")
            headline(figure, "four panels whose labels differ in width", "and a second line")
            buffer = io.BytesIO()
            save(figure, buffer, format="png", dpi=70)
        drawn.append(buffer.getvalue())
    assert drawn[0] == drawn[1]
