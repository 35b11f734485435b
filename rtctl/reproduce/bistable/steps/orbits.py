"""Motions of the models: 100 starts at 45 frequencies, the paper's rule and the final state of the motions."""

from __future__ import annotations

from collections import Counter

import numpy as np
from matplotlib.axes import Axes
from scipy.integrate import solve_ivp

from rtctl.border.arrays import FloatArray
from rtctl.orbits.classes import Kind
from rtctl.plots.elements.style import BLACK, BLUE, GREEN, ORANGE, VERMILION
from rtctl.plots.reproduce_bistable import draw
from rtctl.reproduce.bistable.collected import collected
from rtctl.reproduce.bistable.models import HM, TRUTH, Beam
from rtctl.reproduce.bistable.steps.global_fit import global_models
from rtctl.reproduce.bistable.swept import Swept, swept
from rtctl.reproduce.study import Comparison, Picture, Row, Run, Section, Table

KINDS = {"interwell": BLUE, "intrawell": GREEN, "transient_chaos": ORANGE, "chaotic": VERMILION}
RARE = 0.03
"""Share of the starts below which an orbit is not compared: whether any start meets it is chance."""


# long because it writes one section of the report in the order of its page
def orbits(run: Run) -> Section:
    """Return the section on the sweep of section 2.3, and on what 100 s of transient leave out."""
    models: dict[str, Beam] = {name: fit.beam for name, fit in global_models(collected(run)).items()}
    models["truth"] = TRUTH
    found = {name: swept(beam, run.short) for name, beam in models.items()}
    rows, kinds, sets = [], [], []
    for name, one in found.items():
        by_rule = Counter(one.orbits.by_rule)
        kind = Counter(one.orbits.kind)
        frequency = one.lanes.frequency_hz
        called = frequency[[own is Kind.CHAOTIC for own in one.orbits.by_rule]]
        lasting = frequency[[own is Kind.CHAOTIC for own in one.orbits.kind]]
        kinds.append(
            (name, *(str(by_rule[own]) for own in (Kind.INTRAWELL, Kind.INTERWELL, Kind.CHAOTIC)),
             str(kind[Kind.TRANSIENT_CHAOS]), str(kind[Kind.CHAOTIC]), str(kind[Kind.UNSETTLED]),
             str(kind[Kind.UNBOUNDED]), _range(called), _range(lasting))
        )  # fmt: skip
        if name in ("HM", "truth"):
            rows += [
                Row(quantity=f"{name}: starts that the rule calls chaotic", unit="", paper=None,
                    ours=by_rule[Kind.CHAOTIC]),
                Row(quantity=f"{name}: of these settled later", unit="", paper=None,
                    ours=sum(rule is Kind.CHAOTIC and own not in (Kind.CHAOTIC, Kind.UNSETTLED)
                             for rule, own in zip(one.orbits.by_rule, one.orbits.kind, strict=True))),
                Row(quantity=f"{name}: least frequency of lasting chaos", unit="Hz", paper=11.75, ours=_least(lasting),
                    note="the paper's is of its records"),
                Row(quantity=f"{name}: largest frequency of lasting chaos", unit="Hz", paper=14.5,
                    ours=_least(-lasting, -1.0)),
            ]  # fmt: skip
        sets.append((name, *_same_sets(one, found["truth"])))
    rows += [
        Row(quantity="HM's sweep", unit="CPU s", paper=None, ours=found["HM"].processor_s,
            note=f"{len(found['HM'].orbits.kind)} starts, each until it repeats"),
        Row(quantity="damping that ode45's default tolerance adds to HM, one well", unit="% of HM's", paper=None,
            ours=100.0 * tolerance_damping(8.5) / HM.damping, note="the same pair of formulas, relative "
            "tolerance 1e-3"),
        Row(quantity="and through both wells", unit="% of HM's", paper=None,
            ours=100.0 * tolerance_damping(11.5) / HM.damping),
    ]  # fmt: skip
    _draw(run, found)
    hm = found["HM"].orbits
    slow = hm.settled_s[np.isfinite(hm.settled_s)]
    return Section(
        title="Classes of motion",
        text=f"{len(hm.kind)} starts a model, followed until they repeat: the period is the stroboscopic "
        f"map's, up to 16 "
        "periods of the drive, whatever the time that takes (up to 1000 s). At 100 s the paper's rule is applied to "
        "what has not settled, and the largest Lyapunov exponent measured over 200 periods: a start that "
        "parts from its "
        "neighbours then and settles later is transient chaos. "
        f"HM needs {np.median(slow):.0f} s in the median and up to {slow.max():.0f} s to settle.\n\n"
        "Near fractal boundaries the counts depend on the last digits of starts and steps; the sets of orbits "
        "that exist "
        "at a frequency do not, so these are compared: at how many frequencies a model has the same set of kinds and "
        "periods as the truth.",
        parts=(
            Comparison(title="Chaos that lasts and chaos that does not", rows=tuple(rows)),
            Table(title="Starts by the paper's rule at 100 s, and in the end",
                  headers=("model", "rule: one well", "rule: both", "rule: chaotic", "transient chaos", "lasting chaos",
                           "unsettled", "unbounded", "rule's chaos [Hz]", "lasting chaos [Hz]"),
                  rows=tuple(kinds), numbers=(1, 2, 3, 4, 5, 6, 7)),
            Table(title="Sets of orbits against the truth's", headers=("model", "frequencies with the same set", "of"),
                  rows=tuple(sets), numbers=(1, 2)),
            Picture(file="classes.png", alt="Shares of kinds of motion over frequency for HM and the truth",
                    caption="Shares of the starts over frequency, in the end (filled) and by the paper's rule at 100 s "
                    "(lines)."),
        ),
    )  # fmt: skip


def tolerance_damping(start_mm: float, seconds: float = 20.0) -> float:
    """Return the damping [1/s] equivalent to the energy that an undamped HM loses in Dormand and Prince's pair.

    It is computed for free motion from rest at `start_mm`: dE/dt = - damping v^2. Negative where it gains energy.
    """

    def rate(_: float, y: FloatArray) -> list[float]:
        return [y[1], -(HM.stiffness + HM.cubic * y[0] * y[0]) * y[0]]

    found = solve_ivp(rate, (0.0, seconds), [start_mm, 0.0], method="RK45", rtol=1e-3, atol=1e-6)
    z, v = found.y
    energy = 0.5 * v**2 + 0.5 * HM.stiffness * z**2 + 0.25 * HM.cubic * z**4
    work = float(np.sum(0.5 * (v[1:] ** 2 + v[:-1] ** 2) * np.diff(found.t)))
    return float(energy[0] - energy[-1]) / work


def _range(frequency: FloatArray) -> str:
    return f"{frequency.min():g} to {frequency.max():g}" if len(frequency) else "none"


def _least(frequency: FloatArray, sign: float = 1.0) -> float | None:
    return sign * float(frequency.min()) if len(frequency) else None


def _same_sets(one: Swept, truth: Swept) -> tuple[str, str]:
    frequencies = np.unique(truth.lanes.frequency_hz)
    same = sum(_set_at(one, at) == _set_at(truth, at) for at in frequencies.tolist())
    return str(same), str(len(frequencies))


def _set_at(one: Swept, frequency_hz: float) -> set[tuple[str, int]]:
    """Return kinds and periods of the orbits at a frequency; chaos counts once."""
    found: Counter[tuple[str, int]] = Counter()
    starts = np.flatnonzero(one.lanes.frequency_hz == frequency_hz).tolist()
    for lane in starts:
        points = one.orbits.points[lane]
        inside = len(points) > 0 and bool((points > 0.0).all() or (points < 0.0).all())
        period = int(one.orbits.period[lane])
        kind = ("one well" if inside else "both") if period > 0 else str(one.orbits.kind[lane])
        found[kind, period] += 1
    return {orbit for orbit, count in found.items() if count >= RARE * len(starts)}


def _draw(run: Run, found: dict[str, Swept]) -> None:
    def fill(axes: list[Axes]) -> None:
        for axis, name in zip(axes, ("HM", "truth"), strict=True):
            one = found[name]
            frequency = one.lanes.frequency_hz
            at = np.unique(frequency)
            kinds = np.array([str(own) for own in one.orbits.kind])
            rules = np.array([str(own) for own in one.orbits.by_rule])
            base = np.zeros(len(at))
            for kind, color in KINDS.items():
                share = np.array([np.mean(kinds[frequency == own] == kind) for own in at])
                axis.bar(at, share, width=0.8 * float(np.diff(at).min(initial=1.0)), bottom=base, color=color,
                         label=kind.replace("_", " "))  # fmt: skip
                base += share
            called = [np.mean(rules[frequency == own] == "chaotic") for own in at]
            axis.plot(
                at, 1.0 - np.array(called), color=BLACK, linewidth=1.0, label="above: chaotic by the rule"
            )
            axis.set_title(name)
            axis.set_xlabel("excitation frequency [Hz]")
            axis.set_ylabel("share of the starts")
        handles, labels = axes[0].get_legend_handles_labels()
        figure = axes[0].get_figure()
        if figure is not None:
            figure.legend(handles, labels, fontsize=8, loc="outside lower center", ncols=4)

    draw(run.pictures / "classes.png", (9.0, 3.9), (1, 2), fill)
