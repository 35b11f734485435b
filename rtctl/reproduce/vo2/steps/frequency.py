"""Figure 6: how much the D–I and the D–R loops change from quasi-static to 30 Hz.

A loop is folded over its periods (mean of each phase), cut into two branches at the extremes of its abscissa, and
compared with the quasi-static one on a grid: |D_f(x) - D_0(x)|, mean and largest of both branches.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import RunError
from rtctl.plots.elements.small_png import save_small_png
from rtctl.plots.reproduce_vo2 import frequency_figure
from rtctl.reproduce.study import Picture, Run, Section, Table
from rtctl.reproduce.vo2.bench import devices, in_parallel, seeds, spread, variant
from rtctl.reproduce.vo2.steps.excitation import SteadyLoops, major_branches, mean_of, measured
from rtctl.scenario.bundled import bundled_scenarios
from rtctl.scenario.command_sequence import command_sequences
from rtctl.scenario.schema import checked_scenario
from rtctl.session.loop_setup import open_driver
from rtctl.session.open_loop import play
from rtctl.wiring import build_driver

FREQUENCIES_HZ = (1.0, 3.0, 10.0, 30.0)
PERIOD_S = 1e-4
LONGEST_S = 1.0
PHASES = 200
GRID = 300
MARGIN = 0.08
"""Excluded share at either end of ln R and of the current: there the branches meet, and those of D–R are vertical."""
MODE = {"swing_share": 1.0, "swing_frequency": "7.5 kHz", "swing_damping": 0.01}
LAG = {"domain_lag": "0.2 ms"}


class Change(NamedTuple):
    """Change against the quasi-static loop [% of its range of D]."""

    mean: float
    largest: float


class Sine(NamedTuple):
    """A run at one frequency."""

    plant: str
    frequency_hz: float
    seed: int


# long because it writes one section of the report in the order of its page
def compute(run: Run) -> Section:
    """Return the section."""
    plants = {device: device for device in devices(run)}
    if not run.short:
        plants |= {
            "vo2_a, beam with a mode at 7.5 kHz, Q = 50": variant(run, "vo2_a", "mode", effects=MODE),
            "vo2_a, transition 0.2 ms behind the temperature": variant(run, "vo2_a", "lag", effects=LAG),
        }
    frequencies = FREQUENCIES_HZ[-2:] if run.short else FREQUENCIES_HZ
    asked = {name: (frequencies, seeds(run)) for name in plants}
    asked |= {name: (frequencies[-2:], seeds(run)[:2]) for name in plants if name not in devices(run)}
    jobs = [
        Sine(plants[name], frequency, seed)
        for name, (wanted, of) in asked.items()
        for frequency in wanted
        for seed in of
    ]
    loops = dict(zip(jobs, in_parallel(run, folded, jobs), strict=True))
    still = {
        device: [measured(run, device, seed) for seed in seeds(run)] for device in devices(run)
    }  # a plant's variants are those of its first device
    rows = []
    for name, plant in plants.items():
        rest = mean_of(still.get(name, still["vo2_a"]))
        for frequency in asked[name][0]:
            found = [loops[Sine(plant, frequency, seed)] for seed in asked[name][1]]
            against_i = [change(rest, loop, along="current") for loop in found]
            against_r = [change(rest, loop, along="resistance") for loop in found]
            ratio = np.mean([one.mean for one in against_i]) / np.mean([one.mean for one in against_r])
            rows.append((
                name, f"{frequency:g}", spread([one.mean for one in against_i]),
                f"{np.mean([one.largest for one in against_i]):.1f}", spread([one.mean for one in against_r]),
                f"{np.mean([one.largest for one in against_r]):.1f}", f"{ratio:.3g}",
            ))  # fmt: skip
    table = Table(
        title="Change of the loops against the quasi-static ones [% of the range of D]",
        headers=("device", "frequency [Hz]", "D–I, mean", "D–I, largest", "D–R, mean", "D–R, largest",
                 "mean D–I / mean D–R"),
        rows=tuple(rows),
        text="Means over the seeds, with their least and largest.",
        numbers=(1, 2, 3, 4, 5, 6),
    )  # fmt: skip
    first = {frequency: loops[Sine("vo2_a", frequency, seeds(run)[0])] for frequency in frequencies}
    figure = frequency_figure(mean_of(still["vo2_a"]), first)
    save_small_png(figure, run.pictures / "fig06-frequency.png")
    return Section(
        title="Frequency dependence (figure 6)",
        text=(
            "Sines of the current over its whole range, sampled every 0.1 ms, folded after the first period. The paper "
            "shows the loops without a figure for their change; here is one.\n\n"
            "D against the current changes by tens of percent, D against R by a fraction of one: the finding on which "
            "self-sensing stands. What is left of D–R is the same at every frequency: it is the floor of the "
            "comparison (the first heating from the cold against a cycle, chords between samples), and no rate "
            "dependence, of which these devices have none. The paper puts its own mild change down to the structural "
            "dynamics of the cantilever. A mode at 7.5 kHz, as a beam of these dimensions has, does nothing of the "
            "kind at 30 Hz (it adds (30 / 7500)² = 2e-5 of the deflection); a film that switches 0.2 ms behind the "
            "temperature that bends the beam does, and grows with the frequency as the paper's does."
        ),
        parts=(
            table,
            Picture(
                file="fig06-frequency.png",
                caption="Figure 6, device A: deflection against current and against resistance, by frequency.",
                alt="Two panels: D against I fans out with frequency, D against R does not",
            ),
        ),
    )


def folded(job: Sine) -> SteadyLoops:
    """Return one period (`PHASES`,) from the least current, the mean of all but the first."""
    whole = max(2.0, np.ceil(LONGEST_S * job.frequency_hz))
    tables: dict[str, Any] = {
        "scenario": {"title": "figure 6", "period": f"{PERIOD_S} s"},
        "driver": {"kind": "inprocess", "device": job.plant, "seed": job.seed},
        "safety": {
            "frozen_after": 0
        },  # ten times faster than elsewhere, a converter's step may last in the metal
        "excitation": [
            {
                "kind": "sine",
                "duration": f"{whole / job.frequency_hz} s",
                "frequency": f"{job.frequency_hz} Hz",
            }
        ],
    }
    scenario = checked_scenario(tables, "figure 6")
    driver = build_driver(scenario, bundled_scenarios())
    levels = command_sequences(scenario)[0]
    signals, outcome, *_ = play(scenario, driver, levels, open_driver(driver, scenario), lambda: False)
    if outcome.fault is not None:
        raise RunError(f"{job}: {outcome.fault}: {outcome.message}")
    turns = job.frequency_hz * PERIOD_S * (np.arange(len(levels)) + 1.0)  # a reading is from its period's end
    kept = turns >= 1.0
    bins = (PHASES * (turns[kept] % 1.0)).astype(np.int64)
    count = np.bincount(bins, minlength=PHASES)

    def mean(values: FloatArray) -> FloatArray:
        found: FloatArray = np.bincount(bins, values[kept], minlength=PHASES) / count
        return found

    middle = (np.arange(PHASES) + 0.5) / PHASES
    current = 0.5 * (levels.max() + levels.min()) - 0.5 * np.ptp(levels) * np.cos(2.0 * np.pi * middle)
    return SteadyLoops(current, np.exp(mean(np.log(signals["resistance"]))), mean(signals["deflection"]))


def change(rest: SteadyLoops, loop: SteadyLoops, *, along: str) -> Change:
    """Return the change of a folded loop against the major loop of quasi-static samples."""
    cooling, heating = major_branches(rest.current_mA)
    x, still = (one.current_mA if along == "current" else -np.log(one.resistance_ohm) for one in (loop, rest))
    low, high = max(x.min(), still.min()), min(x.max(), still.max())
    grid = np.linspace(low + MARGIN * (high - low), high - MARGIN * (high - low), GRID)
    first, last = int(np.argmin(x)), int(np.argmax(x))
    rising = np.roll(np.arange(PHASES), -first)[: (last - first) % PHASES + 1]
    falling = np.roll(np.arange(PHASES), -last)[: (first - last) % PHASES + 1]
    differences = [
        _on(grid, x[branch], loop.deflection_um[branch]) - _on(grid, still[major], rest.deflection_um[major])
        for branch, major in ((rising, heating), (falling, cooling))
    ]
    percent = 100.0 * np.abs(np.concatenate(differences)) / np.ptp(rest.deflection_um)
    return Change(float(percent.mean()), float(percent.max()))


def _on(grid: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    order = np.argsort(x, kind="stable")
    return np.interp(grid, x[order], y[order])
