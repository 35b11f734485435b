"""Figures 4 and 5: the damped oscillation, R–I and D–I, and D–R loops that are not nested, as a number.

Nested loops would stay between the two branches of the major one. How far the minor loops leave it is measured on the
mean of several recordings, and asked of every estimator on the same resistance: an operator with non-negative weights
from R to D cannot leave it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.estimators import ESTIMATORS as BUILDERS
from rtctl.identification.vo2.staircase import extract_steady_states
from rtctl.measured.reading import read_dataset
from rtctl.models.vo2 import Vo2Model
from rtctl.plots.elements.small_png import save_small_png
from rtctl.plots.hysteresis import hysteresis_figure
from rtctl.plots.loops import leaves_major_loop
from rtctl.reproduce.study import Comparison, Picture, Row, Run, Section, Table
from rtctl.reproduce.vo2 import paper
from rtctl.reproduce.vo2.bench import (
    ESTIMATORS,
    devices,
    model_of,
    scenario_of,
    seeds,
    spread,
)
from rtctl.reproduce.vo2.models import Models, models, to_the_letter
from rtctl.scenario.bundled import bundled_scenarios
from rtctl.session.acquisition import acquire
from rtctl.wiring import build_driver

HOLD_S = 0.01
STEP = "0.25 %"
"""Step relative to the current's range: at the 1 % of an identification chords are as far off as the loops."""

FINER = 8
SHOWN_MODELS = 3


class SteadyLoops(NamedTuple):
    """Steady states of one damped oscillation, (n,) each."""

    current_mA: FloatArray
    resistance_ohm: FloatArray
    deflection_um: FloatArray

    @property
    def leaving_um(self) -> float:
        """Distance [um] by which minor D–R loops leave the major one; 0 where they do not."""
        found = leaves_major_loop(*self)
        return found.overshoot_um if found else 0.0


def compute(run: Run) -> Section:
    """Return the section."""
    found = {device: [measured(run, device, seed) for seed in seeds(run)] for device in devices(run)}
    averaged = {device: mean_of(loops) for device, loops in found.items()}
    identified = models(run, "damped")
    picture = drawn(run, averaged["vo2_a"])
    return Section(
        title="Excitation and hysteresis (figures 4 and 5)",
        text=(
            "The paper's damped oscillation in steps of 0.25 % of the current's range, each held 10 ms, its end "
            "taken as the steady state; "
            f"{len(seeds(run))} recordings a device, which differ in noise alone.\n\n"
            "As in the paper, R falls and D rises on two branches each, D is not monotone in the current (expansion "
            "bends against the transition), and the D–R loops are not nested. The last table puts a number to that: "
            "how far minor loops leave the major one. Preisach and EGPI from R to D cannot, as the paper says. That "
            "the composite can, as the paper also says, does not make its loops the device's: by its form and by what "
            "its second half is fitted to, it leaves the major loop hardly at all or by several times as much. Only "
            "the observer leaves it as far as the device does. On device L2P there is next to nothing to leave."
        ),
        parts=(
            _ranges(averaged["vo2_a"]),
            _shapes(averaged),
            _leaving(run, found, averaged, identified),
            picture,
        ),
    )


def measured(run: Run, device: str, seed: int) -> SteadyLoops:
    """Return one recording, through `acquire`."""
    folder = run.out / "work" / "damped" / f"{device}-{seed}"
    if not (folder / "dataset.toml").is_file():
        whole = scenario_of("acquire_vo2", device, seed, [f'excitation.0.step="{STEP}"'])
        scenario = whole.model_copy(update={"excitation": whole.excitation[:1]})
        driver = build_driver(scenario, bundled_scenarios())
        acquire(scenario, driver, folder, lambda: False, lambda text: None)
    ends = extract_steady_states(read_dataset(folder / "dataset.toml"))
    kept = ends.scored
    return SteadyLoops(ends.current_mA[kept], ends.resistance_ohm[kept], ends.deflection_um[kept])


def mean_of(loops: list[SteadyLoops]) -> SteadyLoops:
    """Return the mean of recordings of the same currents; the geometric mean for resistance."""
    return SteadyLoops(
        loops[0].current_mA,
        np.exp(np.mean([np.log(one.resistance_ohm) for one in loops], axis=0)),
        np.mean([one.deflection_um for one in loops], axis=0),
    )


def estimated(model: Vo2Model, kind: str, loops: SteadyLoops, hold_s: float = HOLD_S) -> FloatArray:
    """Return an estimator's deflection for currents and resistances, each held `hold_s`; from a full cooling."""
    estimator = BUILDERS[kind](model)
    pairs = list(zip(loops.current_mA.tolist(), loops.resistance_ohm.tolist(), strict=True))
    values = [estimator.start((pairs[0][0],), (pairs[0][1],)).value]
    values += [estimator.step((current,), (ohm,), hold_s).value for current, ohm in pairs[1:]]
    return np.array(values)


def _ranges(loops: SteadyLoops) -> Comparison:
    kohm, deflection = 1e-3 * loops.resistance_ohm, loops.deflection_um
    return Comparison(
        title="Ranges, device A beside the paper's",
        rows=(
            Row(quantity="least current", unit="mA", paper=paper.CURRENT_MA[0], ours=float(loops.current_mA.min())),
            Row(quantity="largest current", unit="mA", paper=paper.CURRENT_MA[1], ours=float(loops.current_mA.max())),
            Row(quantity="least resistance", unit="kohm", paper=paper.LEAST_RESISTANCE_KOHM, ours=float(kohm.min())),
            Row(quantity="largest resistance", unit="kohm", paper=None, ours=float(kohm.max()),
                note="lost in the transcription; figure 4b shows about 130"),
            Row(quantity="range of deflection", unit="um", paper=paper.RANGE_UM, ours=float(np.ptp(deflection)),
                note="device A was built after the paper's figures: no finding of ours"),
        ),
    )  # fmt: skip


def _shapes(found: dict[str, SteadyLoops]) -> Table:
    rows = []
    for device, loops in found.items():
        r_width, d_width = widths(loops)
        rows.append((
            device, f"{np.ptp(loops.deflection_um):.1f}", f"{1e-3 * loops.resistance_ohm.min():.2f}",
            f"{1e-3 * loops.resistance_ohm.max():.0f}", f"{r_width:.2f}", f"{d_width:.2f}", f"{fall_um(loops):.2f}",
        ))  # fmt: skip
    return Table(
        title="Loops of the three devices",
        headers=(
            "device", "range of D [um]", "least R [kohm]", "largest R [kohm]", "R–I loop, width at half height [mA]",
            "D–I loop, width at half height [mA]", "fall of D beyond its maximum [um]",
        ),
        rows=tuple(rows),
        text=(
            "Half height: of ln R and of D. The fall is what expansion takes back once the film has switched; R "
            "hardly moves there, which is where every estimator from R alone has its largest errors."
        ),
        numbers=tuple(range(1, 7)),
    )  # fmt: skip


def widths(loops: SteadyLoops) -> tuple[float, float]:
    """Return the widths [mA] of the major loops of ln R and of D against the current, at the middle of each range."""
    cooling, heating = major_branches(loops.current_mA)
    found = []
    for values in (-np.log(loops.resistance_ohm), loops.deflection_um):
        middle = 0.5 * (values.min() + values.max())
        at = [_crossing(loops.current_mA[branch], values[branch], middle) for branch in (heating, cooling)]
        found.append(at[0] - at[1])
    return found[0], found[1]


def major_branches(current_mA: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return samples of the sweep down from the first maximum and of the first sweep up, from the cold."""
    top = int(np.argmax(current_mA))
    bottom = top + int(np.argmin(current_mA[top:]))
    return np.arange(top, bottom + 1), np.arange(0, top + 1)


def _crossing(x: FloatArray, y: FloatArray, level: float) -> float:
    """Return the x where y first crosses the level."""
    k = int(np.flatnonzero(np.diff(np.sign(y - level)))[0])
    return float(x[k] + (level - y[k]) * (x[k + 1] - x[k]) / (y[k + 1] - y[k]))


def fall_um(loops: SteadyLoops) -> float:
    """Return how far D falls again on the first heating, from its maximum to the highest current [um]."""
    _, heating = major_branches(loops.current_mA)
    return float(loops.deflection_um[heating].max() - loops.deflection_um[heating[-1]])


def _leaving(
    run: Run,
    found: dict[str, list[SteadyLoops]],
    averaged: dict[str, SteadyLoops],
    identified: Models,
) -> Table:
    rows = []
    for device, loops in found.items():
        given = finer(averaged[device], 2 if run.short else FINER)
        single = spread([one.leaving_um for one in loops])
        left = [_left_by(model_of(identified[device, seed]), given) for seed in seeds(run)[:SHOWN_MODELS]]
        by_model = [spread(column) for column in zip(*left, strict=True)]
        rows.append((device, f"{given.leaving_um:.2f}", single, *by_model))
    return Table(
        title="How far minor D–R loops leave the major one [um]",
        headers=(
            "device", "device, mean of the recordings", "each recording by itself", ESTIMATORS[0],
            "composite to the letter", *ESTIMATORS[1:],
        ),
        rows=tuple(rows),
        text=(
            "Of the estimators, identified on other recordings of the same oscillation: their output on the mean "
            "resistance, of three identifications. `composite to the letter` has its second half identified on the "
            "current, as the paper does it, `composite` on what its first half gives. Samples within 8 % of either "
            "end of ln R do not count."
        ),
        numbers=tuple(range(1, 4 + len(ESTIMATORS))),
    )  # fmt: skip


def _left_by(model: Vo2Model, given: SteadyLoops) -> list[float]:
    """Return how far each estimator's own loops leave their major one [um], in the order of the table."""
    outputs = [estimated(model, kind, given) for kind in ESTIMATORS]
    outputs.insert(1, estimated(to_the_letter(model), "composite", given))
    return [replaced(given, output).leaving_um for output in outputs]


def finer(loops: SteadyLoops, count: int) -> SteadyLoops:
    """Return the same path with `count` samples for one: chords across a steep envelope's corner are not its loops."""
    index = np.arange(len(loops.current_mA), dtype=np.float64)
    wanted = np.linspace(0.0, index[-1], count * (len(index) - 1) + 1)
    return SteadyLoops(
        np.interp(wanted, index, loops.current_mA),
        np.exp(np.interp(wanted, index, np.log(loops.resistance_ohm))),
        np.interp(wanted, index, loops.deflection_um),
    )


def replaced(loops: SteadyLoops, deflection_um: FloatArray) -> SteadyLoops:
    """Return the same loops with another deflection."""
    return loops._replace(deflection_um=deflection_um)


def drawn(run: Run, loops: SteadyLoops) -> Picture:
    """Draw figures 4 and 5 of device A."""
    figure = hysteresis_figure(*loops, title="Device A under the damped oscillation")
    save_small_png(figure, run.pictures / "fig04-05-hysteresis.png")
    return Picture(
        file="fig04-05-hysteresis.png",
        caption="Figures 4 and 5, device A: excitation, R–I, D–I; resistance, D–R and where its loops leave the major.",
        alt="Current, resistance and deflection of device A under the damped oscillation, a zoom into the D–R loops",
    )
