"""Figure 11: composite, Preisach and EGPI at levels 6 to 10, their error and the time of a calculation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.plots.elements.small_png import save_small_png
from rtctl.plots.reproduce_vo2 import levels_figure
from rtctl.reproduce.study import Comparison, Picture, Row, Run, Section, Table
from rtctl.reproduce.vo2 import paper
from rtctl.reproduce.vo2.bench import (
    DEVICES,
    Trial,
    devices,
    in_parallel,
    length,
    model_of,
    scored,
    seeds,
    spread,
)
from rtctl.reproduce.vo2.models import all_identified, identification
from rtctl.reproduce.vo2.steps.excitation import measured
from rtctl.reproduce.vo2.steps.identification import Fitted, fit_errors
from rtctl.reproduce.vo2.steps.timing import TIMED, CalculationTime, calculation_times

RANDOM = "random_staircase"
ByLevel = dict[tuple[str, int, str], list[float]]
"""Mean errors [% of range] by (device, level, estimator), one a seed."""
MOST_SEEDS = 2
OFF_PERCENT = 4.0
LEVELS = (6, 7, 8, 9, 10)


def compute(run: Run) -> Section:
    """Return the section."""
    levels = LEVELS[:3:2] if run.short else LEVELS
    keys = [(device, n, seed) for device in devices(run) for n in levels for seed in seeds(run)[:MOST_SEEDS]]
    jobs = [identification(run, device, seed, "damped", plays=n, levels=n) for device, n, seed in keys]
    paths = all_identified(run, jobs)
    trials = [
        Trial(RANDOM, device, path, kind, seed, length(run, RANDOM))
        for (device, _, seed), path in zip(keys, paths, strict=True)
        for kind in TIMED
    ]
    scores = dict(zip(trials, in_parallel(run, scored, trials), strict=True))
    fitted = in_parallel(run, fit_errors, [Fitted(path, "damped") for path in paths])
    random: ByLevel = {}
    fit: ByLevel = {}
    for (device, n, seed), path, errors in zip(keys, paths, fitted, strict=True):
        for kind in TIMED:
            score = scores[Trial(RANDOM, device, path, kind, seed, length(run, RANDOM))]
            random.setdefault((device, n, kind), []).append(score.sensing_mean)
            fit.setdefault((device, n, kind), []).append(errors[kind].mean_percent)
    cells = [(device, n) for device in devices(run) for n in levels]
    shown = {n: model_of(paths[keys.index((DEVICES[0], n, seeds(run)[0]))]) for n in levels}
    ohm = measured(run, "vo2_a", seeds(run)[0]).resistance_ohm
    times = {n: calculation_times(model, ohm) for n, model in shown.items()}
    rows = [
        (device, str(n), *(spread(fit[device, n, kind]) for kind in TIMED),
         *(spread(random[device, n, kind]) for kind in TIMED))
        for device, n in cells
    ]  # fmt: skip
    return Section(
        title="Composite against Preisach and EGPI at levels 6 to 10 (figure 11)",
        text=(
            "A level is the number of plays, or of Preisach levels. Identified on the damped oscillation alone; errors "
            "on the fitted data, as the paper's figure has them, and on random currents that no fit has seen. The "
            "paper gives no figures of this one beyond those of the previous section. Two identifications a cell.\n\n"
            + ranking(devices(run), levels, random)
            + " More levels help Preisach up to ten, and the others not reliably: what limits an estimator from R "
            "alone is not the number of its plays." + outliers(fit)
        ),
        parts=(
            Table(
                title="Mean error [% of range], least and largest of the identifications: fit, then random currents",
                headers=(
                    "device", "level", *(f"{kind}, fit" for kind in TIMED), *(f"{kind}, random" for kind in TIMED)
                ),
                rows=tuple(rows),
                numbers=tuple(range(1, 2 + 2 * len(TIMED))),
            ),
            _time_beside(times, levels),
            _times(times),
            _drawn(run, levels, fit, random, times),
        ),
    )  # fmt: skip


def ranking(names: Sequence[str], levels: Sequence[int], random: ByLevel) -> str:
    """Return how often each estimator has the lowest error on random currents, and how often the paper's order."""
    three = ("composite", "preisach", "egpi")
    cells = [(device, n) for device in names for n in levels]
    best = [min((float(np.mean(random[(*one, kind)])), kind) for kind in three)[1] for one in cells]
    counts = ", ".join(f"{kind} in {best.count(kind)}" for kind in three)
    return (
        f"The paper's composite has the lowest error at every level. On random currents, of these three the lowest is "
        f"{counts} of {len(cells)} cells."
    )


def outliers(fit: ByLevel) -> str:
    """Return identifications whose estimator is far off on the very data that it was fitted to."""
    cells = [
        f"{kind} at level {n} on {device}"
        for (device, n, kind), found in fit.items()
        if max(found) > OFF_PERCENT
    ]
    if not cells:
        return ""
    return (
        f"\n\nOff by more than {OFF_PERCENT:g} % in one of its identifications: {', '.join(cells)}. There a play has a "
        "large weight and hardly moves, and the estimator starts it from a full cooling, the fit from where its first "
        "sample leaves it: a fault of ours, which more plays invite. Six plays, as all other sections have them, show "
        "none of it."
    )


def _time_beside(times: dict[int, dict[str, CalculationTime]], levels: Sequence[int]) -> Comparison:
    at = {"composite": levels[0], "preisach": levels[-1], "egpi": levels[0]}
    rows = []
    for kind, level in at.items():
        found = times[level][kind]
        rows += [
            Row(quantity=f"{kind}, level {level}, called from Python", unit="us", paper=paper.TIME_US[kind],
                ours=found.called_us),
            Row(quantity=f"{kind}, level {level}, in a compiled loop", unit="us", paper=paper.TIME_US[kind],
                ours=1e-3 * found.compiled_ns),
        ]  # fmt: skip
    return Comparison(
        title="Time of one calculation",
        rows=tuple(rows),
        text="The paper's is MATLAB on a laptop of 2011, so the ratio is of languages and machines, not of methods.",
    )


def _times(times: dict[int, dict[str, CalculationTime]]) -> Table:
    return Table(
        title="Time of one calculation by level: compiled [ns] / called from Python [us]",
        headers=("level", *TIMED),
        rows=tuple(
            (str(n), *(f"{found[kind].compiled_ns:.0f} / {found[kind].called_us:.1f}" for kind in TIMED))
            for n, found in times.items()
        ),
        text=(
            "A Preisach operator by its Everett function costs what the reversals cost, not what its cells do: the "
            "paper's sixfold time of Preisach is one of its implementation."
        ),
        numbers=tuple(range(1 + len(TIMED))),
    )


def _drawn(
    run: Run,
    levels: Sequence[int],
    fit: ByLevel,
    random: ByLevel,
    times: dict[int, dict[str, CalculationTime]],
) -> Picture:
    figure = levels_figure(
        levels,
        {kind: [float(np.mean(fit["vo2_a", n, kind])) for n in levels] for kind in TIMED},
        {kind: [float(np.mean(random["vo2_a", n, kind])) for n in levels] for kind in TIMED},
        {kind: [times[n][kind].compiled_ns for n in levels] for kind in TIMED},
        "Device A: error and time of a calculation by level",
    )
    save_small_png(figure, run.pictures / "fig11-levels.png")
    return Picture(
        file="fig11-levels.png",
        caption="Figure 11, device A: error on the fitted data, on random currents, and time of a calculation.",
        alt="Three panels against the level: error of the fit, error on random currents, time, for four estimators",
    )
