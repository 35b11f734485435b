"""Evidence of a diagnosis: coordinates, candidates, isolability, a missing force without a name."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from rtctl.border.arrays import FloatArray
from rtctl.border.statistics import NORMAL_95
from rtctl.output.readable_units import printed_unit, readable_unit
from rtctl.plots.elements.channels import fitting_unit
from rtctl.plots.elements.style import (
    BLACK,
    BLUE,
    GREY,
    RAIL,
    VERMILION,
    few_decades,
    house_style,
    new_figure,
)

TOLD_APART = 0.9
"""Cosines above it are written into their cell."""


def coordinates_figure(names: Sequence[str], shares: Sequence[float]) -> Figure:
    """Draw the share of the error beyond the noise that forces along each coordinate would remove."""
    with house_style():
        figure = new_figure(6.4, 0.7 + 0.32 * len(names))
        axes = figure.subplots()
        rows = np.arange(len(names))[::-1]
        axes.barh(rows, 100.0 * np.asarray(shares), color=[BLUE] + [RAIL] * (len(names) - 1))
        axes.set_yticks(rows, [name.replace("_", " ") for name in names])
        for row, share in zip(rows, shares, strict=True):
            axes.annotate(
                f"{100.0 * share:.0f} %",
                (100.0 * share, row),
                (4, 0),
                textcoords="offset points",
                va="center",
            )
        axes.set_xlim(0.0, 112.0)
        axes.grid(False, axis="y")
        axes.set_xlabel("of the error beyond the noise [%]")
        return figure


def candidates_figure(
    names: Sequence[str],
    errors: Sequence[float],
    marked: Sequence[bool],
    nominal: float,
    noise: float,
    unit: str,
) -> Figure:
    """Draw the RMS error of each fitted candidate, beside the nominal model's and the noise's."""
    with house_style():
        figure = new_figure(8.2, 1.0 + 0.3 * len(names))
        axes = figure.subplots()
        rows, scaled = np.arange(len(names))[::-1], readable_unit(nominal, unit)
        errors = [scaled.of(one) for one in errors]
        nominal, noise = scaled.of(nominal), scaled.of(noise)
        axes.hlines(rows, noise, errors, color=RAIL, linewidth=2.0)
        axes.scatter(errors, rows, s=46.0, color=[BLUE if mark else GREY for mark in marked], zorder=3)
        axes.axvline(noise, color=BLACK, linestyle="--", label="noise")
        axes.axvline(nominal, color=VERMILION, label="nominal model, re-fitted")
        axes.set_yticks(rows, list(names))
        axes.set_xscale("log")
        few_decades(axes.xaxis)
        axes.set_xlim(0.6 * min(noise, *errors), 1.5 * max(nominal, *errors))
        axes.grid(False, axis="y")
        axes.set_xlabel(f"error left on the fitted records, RMS [{printed_unit(scaled.unit)}]")
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.1)
        return figure


CELL_INCHES = 0.2
"""Side of a cell of the matrix of effects."""


def isolability_figure(ids: Sequence[str], visible: FloatArray, cosine: FloatArray) -> Figure:
    """Draw |cos| of the traces of each two effects, and the visible share of each trace."""
    size = (
        CELL_INCHES * len(ids) + 2.4
    )  # as wide as the other pictures, so that a page shows its words as large
    with house_style():
        figure = new_figure(size + 1.6, size)
        matrix, share = figure.subplots(1, 2, width_ratios=(len(ids), 3.0), sharey=True)
        drawn = matrix.imshow(cosine, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
        matrix.grid(False)
        matrix.set_xticks(range(len(ids)), list(ids), rotation=60, ha="right", rotation_mode="anchor")
        matrix.set_yticks(range(len(ids)), list(ids))
        for row, column in zip(*np.nonzero(np.nan_to_num(cosine) > TOLD_APART), strict=True):
            if row != column:
                text = f"{100.0 * cosine[row, column]:.0f}"
                matrix.annotate(text, (column, row), ha="center", va="center", fontsize=6.0, color="white")
        share.barh(range(len(ids)), 100.0 * np.asarray(visible), color=GREY)
        share.set_xlim(0.0, 100.0)
        share.grid(False, axis="y")
        share.set_title("visible [%]")
        figure.colorbar(drawn, ax=[matrix, share], shrink=0.6, label="|cos|")
        return figure


def shape_figure(
    coordinate: str, unit: str, knots: FloatArray, force: FloatArray, error: FloatArray, force_unit: str
) -> Figure:
    """Draw the missing force with its 95 % band."""
    across, up = fitting_unit(unit, knots), fitting_unit(force_unit, force)
    knots, force, error = across.factor * knots, up.factor * force, up.factor * error
    with house_style():
        figure = new_figure(7.2, 4.0)
        axes = figure.subplots()
        axes.axhline(0.0, color=GREY, linewidth=0.8)
        axes.fill_between(
            knots,
            force - NORMAL_95 * error,
            force + NORMAL_95 * error,
            color=BLUE,
            alpha=0.2,
            linewidth=0.0,
            label="95 %",
        )
        axes.plot(knots, force, color=BLUE, marker="o", markersize=4.0, label="force that the model lacks")
        limit = 1.3 * float(np.abs(force).max()) or 1.0
        axes.set_ylim(-max(limit, 1e-300), max(limit, 1e-300))
        axes.set_xlabel(f"{coordinate} [{printed_unit(across.unit)}]")
        axes.set_ylabel(f"force per mass [{printed_unit(up.unit)}]")
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.1)
        return figure


def loops_figure(
    fields: tuple[FloatArray, FloatArray],
    densities: tuple[Sequence[FloatArray], Sequence[FloatArray]],
    current: FloatArray,
    left: tuple[FloatArray, FloatArray],
    unit: str,
) -> Figure:
    """Draw where relays switch in the given loops and in finer ones, and the residuals of both on the staircases.

    Args:
        fields: Nodes of both grids [mA].
        densities: For each grid, densities while heating and while cooling [unit/mA] over its cells.
        current: (n,) [mA].
        left: Residuals (n,) [unit] of both at `current`.
        unit: Unit of the output.
    """
    with house_style():
        figure = new_figure(8.2, 4.8)
        heating, cooling, rest = figure.subplots(3, 1, sharex=True)
        labels = ("today's loops", "learned anew, cells where relays switch")
        for nodes, both, error, colour, label in zip(
            fields, densities, left, (VERMILION, BLUE), labels, strict=True
        ):
            for axes, density in zip((heating, cooling), both, strict=True):
                axes.stairs(density, nodes, color=colour, label=label)
            rest.plot(current, np.abs(error), ".", color=colour, markersize=2.5, alpha=0.6)
        heating.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.1)
        heating.set_ylabel(f"heating\n[{printed_unit(unit)}/mA]")
        cooling.set_ylabel(f"cooling\n[{printed_unit(unit)}/mA]")
        rest.set_ylabel(f"left, |error|\n[{printed_unit(unit)}]")
        rest.set_xlabel("steady current of a hold [mA]")
        return figure
