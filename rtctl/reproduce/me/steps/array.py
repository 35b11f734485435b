"""Figure 14: 55 Duffing equations trained at 0.28 mT and solved at 0.4 mT; the mode's shape drawn and animated."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.identification.oscillator.annealing import AnnealingOptions
from rtctl.identification.oscillator.tone_cost import Objective, compute_scores, simulate_tone
from rtctl.plots.elements.small_png import save_small_png
from rtctl.plots.elements.style import house_style, new_figure
from rtctl.reproduce.me import device
from rtctl.reproduce.me.fits import Box, annealing, box, driven, tone_record, truth
from rtctl.reproduce.me.printed import TABLE_A1
from rtctl.reproduce.me.steps.coil import CLAMPED_FREE
from rtctl.reproduce.study import Comparison, Picture, Row, Run, Section, Table

ALONG, ACROSS = 11, 5
"""Points of the grid: 55, as in the paper."""
FIRST = 0.1
"""Position of the row nearest to the clamp, in lengths."""
TRAINED, SOLVED = 0.28, 0.4
"""mT."""
TRAINING_S, SOLUTION_S, SETTLED_S = 0.1, 1.0, 0.2
AVERAGES = 10
SEED = 2010
PAPER_OMEGA = np.array([one.omega for one in TABLE_A1])
"""Angular frequencies of the paper's table [rad/s]."""
SPOTS = ((2, 10), (0, 10), (2, 5), (0, 0))
"""Indices (across, along) of the points in the table: tip, corner, middle, clamp."""


class Point(NamedTuple):
    """Result of the array for one point at 0.4 mT."""

    correlation: float
    """Correlation with the record, all points solved at one frequency."""
    own_frequency: float
    """Correlation, solved at the frequency that this point's training found."""
    amplitude: float
    """Amplitude of the solution [um]."""


def mode(x: FloatArray) -> FloatArray:
    """Return the first bending mode of a clamped beam, 1 at its tip; x in lengths."""
    b = CLAMPED_FREE
    ratio = (math.cosh(b) + math.cos(b)) / (math.sinh(b) + math.sin(b))

    def shape(s: FloatArray) -> FloatArray:
        return np.cosh(b * s) - np.cos(b * s) - ratio * (np.sinh(b * s) - np.sin(b * s))

    return np.asarray(shape(x) / shape(np.array(1.0)))


def compute(run: Run) -> Section:
    """Return the section."""
    solution_s = 0.4 if run.short else SOLUTION_S
    along = np.linspace(FIRST, 1.0, ALONG)
    shape = np.tile(mode(along), (ACROSS, 1))
    trained = device.response(driven(TRAINING_S, TRAINED))
    solved = device.response(driven(solution_s, SOLVED))
    rng = np.random.default_rng(SEED)
    points = np.empty((ACROSS, ALONG), dtype=object)
    phasors = np.empty((ACROSS, ALONG), dtype=np.complex128)
    for row in range(ACROSS):
        for column in range(ALONG):
            if run.short and (row, column) not in SPOTS:
                continue
            points[row, column], phasors[row, column] = _point(
                trained, solved, float(shape[row, column]), int(rng.integers(2**31))
            )
    tried = [one for one in points.ravel() if one is not None]
    settled = solved[round(SETTLED_S * device.SAMPLE_RATE_HZ) :]
    measured = 0.5 * float(np.ptp(settled))
    if not run.short:
        _draw(run, along, phasors)
        _animate(run, along, phasors)
    return _section(run, tried, points, measured, solution_s)


def _point(trained: FloatArray, solved: FloatArray, size: float, seed: int) -> tuple[Point, complex]:
    """Train and solve one point whose motion is `size` times the tip's; its phasor at 0.4 mT [um]."""
    deviation = device.NOISE / math.sqrt(AVERAGES)
    record = tone_record(device.noisy(size * trained, seed, deviation))
    ranges, scale = box(TRAINED), np.array([1.0, 1.0, size**-2, size, 1.0])
    low, high = ranges.low * scale, ranges.high * scale
    found = annealing(
        record, Objective.RMS, 0.5 * (low + high), AnnealingOptions(seed=seed), Box(low, high)
    ).values
    forced = found * np.array([1.0, 1.0, 1.0, SOLVED / TRAINED, 1.0])
    shared = forced.copy()
    shared[4] = truth()[4]
    test = tone_record(
        device.noisy(size * solved, seed + 1, deviation), round(SETTLED_S * device.SAMPLE_RATE_HZ)
    )
    scores = compute_scores(test, np.vstack((shared, forced)))
    motion = simulate_tone(test, shared)[-10_000:]
    turns = np.exp(-1j * shared[4] * test.period_s * np.arange(len(test.displacement))[-10_000:])
    phasor = complex(2.0 * np.mean(motion * turns))
    return Point(
        float(scores.correlation[0]), float(scores.correlation[1]), 0.5 * float(np.ptp(motion))
    ), phasor


def drift_alone(rates: FloatArray, duration_s: float = 1.0) -> FloatArray:
    """Return the correlation over `duration_s` of tones at these rates with one at their mean, in phase at first."""
    return np.asarray(np.sinc((rates - rates.mean()) * duration_s / math.pi))


def _section(
    run: Run, tried: list[Point], points: NDArray[Any], measured: float, solution_s: float
) -> Section:
    together = np.array([one.correlation for one in tried])
    apart = np.array([one.own_frequency for one in tried])
    largest = max(one.amplitude for one in tried)
    pictures = () if run.short else (
        Picture(file="array.png", caption="Reconstructed first bending mode at 0.4 mT, at its turning point.",
                alt="A beam bent upward, drawn as a surface through 55 points"),
        Picture(file="array.gif", caption="The same over one period of the drive.", alt="The beam swings up and down"),
    )  # fmt: skip
    drift = drift_alone(PAPER_OMEGA)
    return Section(
        title="An array of 55 Duffing oscillators, trained at 0.28 mT and solved at 0.4 mT (figure 14)",
        text=(
            f"Points on {ACROSS} lines of {ALONG}, from a tenth of the length to the tip, each measured by itself: "
            f"{TRAINING_S:g} s from rest at {TRAINED:g} mT, {AVERAGES} averages, annealed (RMS) as above. Then "
            f"the force is scaled to {SOLVED:g} mT and the equation solved for {solution_s:g} s; correlation "
            f"and amplitude are of what "
            f"follows the first {SETTLED_S:g} s, against a record of its own noise. {len(tried)} points.\n\n"
            "The equations of an array share one generator, so they must share one frequency. If each keeps the "
            "frequency that its own training found, neighbours drift apart in phase. Table A1 shows such a "
            f"spread: its ten printed values of Omega differ by {float(np.ptp(PAPER_OMEGA)):.2f} rad/s, so "
            "that tones at these rates that start in phase are up to "
            f"{float(np.abs(PAPER_OMEGA - PAPER_OMEGA.mean()).max()):.2f} rad off after 1 s, and correlate "
            f"{float(drift.min()):.3f} at the worst with their mean: this is a part of the lag that the paper "
            f"sees at border "
            "points, not all of it."
        ),
        parts=(
            Comparison(
                title="The array at 0.4 mT",
                rows=(
                    Row(quantity="correlation, mean of the points", unit="", paper=0.92, ours=float(together.mean())),
                    Row(quantity="correlation, worst point", unit="", paper=None, ours=float(together.min())),
                    Row(quantity="correlation, each at its own frequency, mean", unit="", paper=0.92,
                        ours=float(apart.mean()),
                        note="as the paper's table A1 has it"),
                    Row(quantity="largest amplitude, reconstructed", unit="um", paper=0.74476, ours=largest),
                    Row(quantity="its error against the measured one", unit="%", paper=3.0,
                        ours=100.0 * (largest / measured - 1.0), note="measured means the simulated device, "
                        "without noise"),
                    Row(quantity="points", unit="", paper=55.0, ours=float(len(tried))),
                ),
            ),
            Table(
                title="Some points",
                headers=("line, row", "correlation", "at its own frequency", "amplitude, nm"),
                rows=tuple(
                    (f"{row + 1}, {column + 1}", f"{points[row, column].correlation:.5f}",
                     f"{points[row, column].own_frequency:.5f}", f"{1e3 * points[row, column].amplitude:.2f}")
                    for row, column in SPOTS
                ),
                numbers=(1, 2, 3),
            ),
            *pictures,
        ),
    )  # fmt: skip


def _surface(along: FloatArray, height: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return x, y [mm] and z, with the clamp's row added."""
    x, y = np.meshgrid(np.append(0.0, 3.0 * along), np.linspace(0.0, 1.0, ACROSS))
    return x, y, np.hstack((np.zeros((ACROSS, 1)), height))


def _axes(figure: Any) -> Any:
    axes = figure.add_subplot(projection="3d")
    axes.set_box_aspect((3.0, 1.0, 1.0), zoom=1.1)
    axes.view_init(elev=22.0, azim=-65.0)
    return axes


def _plotted(axes: Any, along: FloatArray, height: FloatArray, limit: float) -> None:
    x, y, z = _surface(along, height)
    axes.plot_surface(x, y, z, cmap="viridis", vmin=-limit, vmax=limit, rstride=1, cstride=1, linewidth=0.3)
    axes.set(zlim=(-limit, limit), ylabel="", zlabel="z [µm]", yticks=(0.0, 1.0))
    axes.set_xlabel("length [mm]", labelpad=12.0)


def _draw(run: Run, along: FloatArray, phasors: NDArray[np.complex128]) -> None:
    limit = float(np.abs(phasors).max())
    turning = np.exp(-1j * np.angle(phasors[ACROSS // 2, -1]))
    with house_style():
        figure = new_figure(6.0, 3.6)
        _plotted(_axes(figure), along, (phasors * turning).real, limit)
        save_small_png(figure, run.pictures / "array.png")


def _animate(run: Run, along: FloatArray, phasors: NDArray[np.complex128]) -> None:
    """Draw sixteen frames of one period, small."""
    limit, frames = float(np.abs(phasors).max()), 16
    with house_style():
        figure = new_figure(3.6, 2.2)
        axes = _axes(figure)

        def frame(number: int) -> tuple[()]:
            axes.clear()
            _plotted(axes, along, (phasors * np.exp(2j * math.pi * number / frames)).real, limit)
            axes.set(xlabel="", zlabel="", xticks=(), yticks=(), zticks=())
            return ()

        moving = FuncAnimation(figure, frame, frames=frames, blit=False)
        moving.save(str(run.pictures / "array.gif"), writer=PillowWriter(fps=12), dpi=70)
