"""Figure 13: noise against convergence, and the information in a steady tone."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.identification.oscillator.annealing import AnnealingOptions
from rtctl.identification.oscillator.tone_cost import Objective, compute_scores
from rtctl.plots.elements.small_png import save_small_png
from rtctl.plots.elements.style import BLUE, GREEN, ORANGE, VERMILION, house_style, new_figure
from rtctl.reproduce.me import device
from rtctl.reproduce.me.fits import annealing, box, driven, least_squares, start_in, tone_record, truth
from rtctl.reproduce.study import Comparison, Picture, Row, Run, Section, Table

LEVELS_DB = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0)
SEEDS = (161, 162, 163)
REST_S, STEADY_S, SETTLED_S = 0.2, 0.3, 0.15
"""A record from rest; one whose first part, seven time constants, is not scored."""
FACTORS = (0.6, 0.8, 1.2, 1.4)
METHODS = {
    "annealing": "annealing (peak-to-peak)",
    "rms": "annealing (RMS)",
    "squares": "that, then least squares",
}


class Point(NamedTuple):
    """Medians over the seeds."""

    error: float
    """RMS error of the model against the motion without noise, relative to it."""
    damping: float
    force: float


# long because it writes one section of the report in the order of its page
def compute(run: Run) -> Section:
    """Return the section."""
    levels = (10.0, 30.0) if run.short else LEVELS_DB
    seeds = SEEDS[:1] if run.short else SEEDS
    options = {"temperatures": 80} if run.short else {}
    rest_s, steady_s = (0.1, 0.22) if run.short else (REST_S, STEADY_S)
    rest = device.response(driven(rest_s))
    steady = device.response(driven(steady_s))
    settled = round(SETTLED_S * device.SAMPLE_RATE_HZ)
    found = {
        "from rest": {level: _points(rest, 0, level, seeds, options) for level in levels},
        "steady": {level: _points(steady, settled, level, seeds, options) for level in levels},
    }
    _draw(run, found)
    family = [_scaled(steady, settled, factor) for factor in FACTORS]
    near = min(levels, key=lambda level: abs(level - 30.0))
    low = levels[0]
    return Section(
        title="Noise against convergence: 30 dB is the search's limit, not the data's (figure 13)",
        text=(
            f"White noise on records at 0.28 mT, 125 kHz: one of {rest_s:g} s from rest, one of a steady tone "
            f"({steady_s - SETTLED_S:g} s scored). {len(seeds)} seeds, far starts for the annealing; least squares "
            "starts where the annealing of the RMS error ended. The error is against the motion without "
            "the noise: what a noisy record leaves of a correlation or a peak-to-peak error says how noisy the "
            "record is, not how good the model.\n\n"
            "The peak-to-peak objective looks at two samples of the record, the largest and the smallest error, so "
            "noise enters it undiminished however long the record is; and it has kinks, on which the search stops "
            "even where there is hardly any noise. The same search of the same records for the RMS error, which "
            "averages over all samples, goes on far below 30 dB, and so does least squares from there: what fails "
            "at 30 dB is the objective and the search, not the data.\n\n"
            "The paper calls its solution unique. From a steady single tone it is not: the record is one complex "
            "amplitude, and F / (k - w^2 + i w c) stays the same when F, c and k - w^2 are scaled together (the "
            "table below), so damping and force are found only as their ratio. From rest, the transient's decay and "
            "its beat tell them apart."
        ),
        parts=(
            Comparison(
                title="Lowest signal-to-noise ratio",
                rows=(
                    Row(quantity=f"RMS error at {near:g} dB, annealing (peak-to-peak)", unit="%", paper=None,
                        ours=100.0 * found["from rest"][near]["annealing"].error,
                        note="the paper's search fails below 30 dB; its figure 13 has no numbers in the text"),
                    Row(quantity=f"the same, least squares, {near:g} dB", unit="%", paper=None,
                        ours=100.0 * found["from rest"][near]["squares"].error),
                    Row(quantity=f"the same, least squares, {low:g} dB", unit="%", paper=None,
                        ours=100.0 * found["from rest"][low]["squares"].error),
                    Row(quantity=f"damping at {near:g} dB from rest, least squares", unit="%", paper=None,
                        ours=100.0 * found["from rest"][near]["squares"].damping),
                    Row(quantity=f"damping at {low:g} dB from rest, least squares", unit="%", paper=None,
                        ours=100.0 * found["from rest"][low]["squares"].damping),
                    Row(quantity=f"damping at {near:g} dB from a steady tone, annealing (RMS)", unit="%", paper=None,
                        ours=100.0 * found["steady"][near]["rms"].damping),
                ),
            ),
            Table(
                title="Medians: RMS error % / damping error % / force error %",
                headers=(
                    "signal to noise, dB",
                    *(f"{kind}, {name}" for kind in found for name in METHODS.values()),
                ),
                rows=tuple(
                    (f"{level:g}", *(_cell(found[kind][level][method]) for kind in found for method in METHODS))
                    for level in levels
                ),
                numbers=tuple(range(7)),
            ),
            Table(
                title="One steady motion, many oscillators: force, damping and k - w^2 scaled together",
                headers=("factor", "force and damping off, %", "correlation, steady", "correlation, from rest"),
                rows=tuple(
                    (f"{factor:g}", f"{100.0 * (factor - 1.0):+.0f}", f"{one:.6f}",
                     f"{_scaled(rest, 0, factor):.4f}")
                    for factor, one in zip(FACTORS, family, strict=True)
                ),
                numbers=(0, 1, 2, 3),
            ),
            Picture(
                file="noise.png",
                caption="RMS error of the model against the motion without noise; of the damping. Grey: the noise.",
                alt="Error over signal-to-noise ratio for three methods, from rest and from a steady tone",
            ),
        ),
    )  # fmt: skip


def _points(
    clean: FloatArray, first: int, level_db: float, seeds: tuple[int, ...], options: dict[str, int]
) -> dict[str, Point]:
    """Run each method at one noise level."""
    deviation = float(np.std(clean[first:])) * 10.0 ** (-level_db / 20.0)
    stimulus = driven(len(clean) / device.SAMPLE_RATE_HZ)
    reference = tone_record(clean, first)
    tries: dict[str, list[tuple[float, float, float]]] = {name: [] for name in METHODS}
    for seed in seeds:
        measured = device.noisy(clean, seed, deviation)
        record, start = tone_record(measured, first), start_in(box(), seed)
        mine = AnnealingOptions(seed=seed, **options)
        annealed = annealing(record, Objective.RMS, start, mine)
        for name, found in (
            ("annealing", annealing(record, Objective.PEAK_TO_PEAK, start, mine)),
            ("rms", annealed),
            ("squares", least_squares(stimulus, measured, annealed.values, first)),
        ):
            if found is None:
                tries[name].append((math.inf, math.inf, math.inf))
                continue
            off = np.abs(found.values / truth() - 1.0)
            error = float(compute_scores(reference, found.values[None, :]).rms[0])
            tries[name].append((error, float(off[0]), float(off[3])))
    return {name: Point(*np.median(np.array(values), axis=0).tolist()) for name, values in tries.items()}


def _scaled(clean: FloatArray, first: int, factor: float) -> float:
    """Return the correlation with an oscillator whose force, damping and detuning are `factor` times the device's.

    The detuning is taken at the motion's amplitude, where the spring is softer.
    """
    values = truth()
    amplitude = float(np.ptp(clean[-2000:])) / 2.0
    shift = 0.75 * values[2] * amplitude**2 + 0.625 * device.QUINTIC * amplitude**4
    detuning = values[1] + shift - values[4] ** 2
    scaled = values * np.array([factor, 1.0, 0.0, factor, 1.0])
    scaled[1] = values[4] ** 2 + factor * detuning
    return float(compute_scores(tone_record(clean, first), scaled[None, :]).correlation[0])


def _cell(point: Point) -> str:
    return f"{100.0 * point.error:.2g} / {100.0 * point.damping:.2g} / {100.0 * point.force:.2g}"


def _draw(run: Run, found: dict[str, dict[float, dict[str, Point]]]) -> None:
    colours = {"annealing": VERMILION, "rms": ORANGE, "squares": BLUE}
    with house_style():
        figure = new_figure(8.4, 3.7)
        panels = figure.subplots(1, 2, sharey=True)
        for axes, (kind, levels) in zip(panels, found.items(), strict=True):
            x = np.array(list(levels))
            axes.plot(x, 100.0 * 10.0 ** (-x / 20.0), color="#C4C4C4", label="the noise")
            for name, label in METHODS.items():
                axes.plot(
                    x,
                    [100.0 * one[name].error for one in levels.values()],
                    color=colours[name],
                    marker="o",
                    label=label,
                )
            axes.plot(
                x,
                [100.0 * one["squares"].damping for one in levels.values()],
                color=GREEN,
                linestyle=":",
                marker=".",
                label="damping, least squares",
            )
            axes.set(xlabel="signal to noise [dB]", yscale="log", title=kind)
        panels[0].set_ylabel("error [%]")
        handles, labels = panels[1].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
        save_small_png(figure, run.pictures / "noise.png")
