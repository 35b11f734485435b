"""The paper's outlook, a composite that depends on rate: D = D_static(v; history) + kappa d(v^2)/dt.

v is the surrogate that the gap-free composite finds in the resistance. Where the film switches tau_d behind the
temperature that bends the beam, v follows the film, and expansion is ahead of it by tau_d d(v^2)/dt: kappa is about
expansion [um/K] times heating [K/mA^2] times tau_d. Found by least squares on the transients of an identification.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import RunError
from rtctl.estimators import ESTIMATORS as BUILDERS
from rtctl.estimators.gap_free import GapFreeEstimator
from rtctl.interfaces import Estimate, Estimator
from rtctl.models.vo2 import Vo2Model
from rtctl.plots.elements.small_png import save_small_png
from rtctl.plots.reproduce_vo2 import errors_figure
from rtctl.reproduce.study import Picture, Run, Section, Table
from rtctl.reproduce.vo2.bench import model_of, seeds, spread, variant
from rtctl.reproduce.vo2.models import Identification, all_identified, data_of, identification
from rtctl.scenario.bundled import bundled_scenarios
from rtctl.scenario.command_sequence import command_sequences
from rtctl.scenario.schema import checked_scenario
from rtctl.session.loop_setup import open_driver
from rtctl.session.open_loop import play
from rtctl.wiring import build_driver

PERIOD_S = 1e-3
DEVICE = "vo2_a"
LAGS_MS = (0.0, 0.2, 1.0)
FREQUENCIES_HZ = (1.0, 10.0, 30.0)
MOST_SEEDS = 2
KINDS = ("composite", "gap_free", "gap_free with a rate term", "observer")
EXPANSION_UM_PER_K, HEATING_K_PER_MA2 = -0.4, 0.945
"""Expansion and heating of device A."""
SHOWN_S = 0.2
VERDICT = (
    " That is too little to earn it a place: it repairs the expansion that runs ahead of the film, not the loops of R "
    "and D against each other, which the lag opens as well. The observer, which knows of no lag either, keeps its lead "
    "as long as the lag is small and loses it at the longest lag and highest frequency: first-order heating is what it "
    "stands on, and to find that it is not enough is the diagnosis's business."
)


class RateTermEstimator:
    """`Estimator` with the gap-free composite and kappa d(v^2)/dt."""

    def __init__(self, model: Vo2Model, kappa: float) -> None:
        """`kappa` [um s/mA^2]."""
        self._inner, self._kappa = GapFreeEstimator(model), kappa
        self.surrogate = self._inner.surrogate
        self._square = 0.0

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Start from a full cooling."""
        estimate = self._inner.start(levels, sensed)
        self._square = estimate.surrogate**2
        return estimate

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """Process one sample."""
        estimate = self._inner.step(levels, sensed, elapsed_s)
        before, self._square = self._square, estimate.surrogate**2
        return estimate._replace(value=estimate.value + self._kappa * (self._square - before) / elapsed_s)


class Recorded(NamedTuple):
    """Samples (n,) of a run: the current of each period, resistance and deflection at its end."""

    current_mA: FloatArray
    resistance_ohm: FloatArray
    deflection_um: FloatArray


def compute(run: Run) -> Section:
    """Return the section."""
    lags = (0.0, LAGS_MS[-1]) if run.short else LAGS_MS
    frequencies = FREQUENCIES_HZ[-1:] if run.short else FREQUENCIES_HZ
    jobs = {(lag, seed): _job(run, lag, seed) for lag in lags for seed in seeds(run)[:MOST_SEEDS]}
    all_identified(run, list(jobs.values()))
    kappas = {key: identified_kappa(job) for key, job in jobs.items()}
    rows = []
    for lag in lags:
        of = [seed for found, seed in jobs if found == lag]
        for frequency in frequencies:
            errors = [sensing_errors(jobs[lag, seed], kappas[lag, seed], frequency, seed) for seed in of]
            cells = (spread([one[kind] for one in errors]) for kind in KINDS)
            rows.append((f"{lag:g}", f"{frequency:g}", *cells))
    return Section(
        title="A composite that depends on rate (the paper's outlook)",
        text=(
            "Device A, and two like it whose film switches 0.2 and 1 ms behind the temperature that bends the beam, "
            "each identified by itself. The rate term is one number, found on the transients of the identification: "
            "no device has to be told that it lags. Self-sensing on sines of the whole range at 1 ms, open loop, "
            f"after the first period; {len(seeds(run)[:MOST_SEEDS])} seeds.\n\n" + _verdict(rows) + VERDICT
        ),
        parts=(_kappa_table(lags, kappas), _error_table(rows), _drawn(run, jobs, kappas, lags[-1])),
    )


def _job(run: Run, lag_ms: float, seed: int) -> Identification:
    if lag_ms == 0.0:
        return identification(run, DEVICE, seed, "full")
    name = f"lag-{lag_ms:g}ms"
    plant = variant(run, DEVICE, name, effects={"domain_lag": f"{lag_ms:g} ms"})
    return identification(run, f"{DEVICE}-{name}", seed, "full", plant=plant)


def identified_kappa(job: Identification) -> float:
    """Return kappa [um s/mA^2] fitted to the records of transients."""
    dataset = data_of(job.folder, job.protocol)
    with_rate, with_error = 0.0, 0.0
    for record in dataset.used_for("fit"):
        signals = record.signals
        rows = Recorded(
            signals["current"][:-1], signals["resistance"][1:], signals["deflection"][1:]
        )  # a dataset's outputs are from before its row's current
        estimates = estimated_by(GapFreeEstimator(model_of(job.model)), rows, record.period_s)
        square = np.array([one.surrogate**2 for one in estimates])
        rate = np.diff(square) / record.period_s
        error = (rows.deflection_um - np.array([one.value for one in estimates]))[1:]
        with_rate += float(rate @ rate)
        with_error += float(rate @ error)
    return with_error / with_rate


def estimated_by(estimator: Estimator, rows: Recorded, period_s: float) -> list[Estimate]:
    """Return the estimate at every sample, from a full cooling."""
    pairs = list(zip(rows.current_mA.tolist(), rows.resistance_ohm.tolist(), strict=True))
    found = [estimator.start((pairs[0][0],), (pairs[0][1],))]
    return found + [estimator.step((current,), (ohm,), period_s) for current, ohm in pairs[1:]]


def sine(plant: str, frequency_hz: float, seed: int) -> Recorded:
    """Run over the whole range; return the first second from the cold and at least four periods after it."""
    duration_s = max(1.0, 5.0 / frequency_hz)
    tables: dict[str, Any] = {
        "scenario": {"title": "a sine of the current"},
        "driver": {"kind": "inprocess", "device": plant, "seed": seed},
        "excitation": [{"kind": "sine", "duration": f"{duration_s} s", "frequency": f"{frequency_hz} Hz"}],
    }
    scenario = checked_scenario(tables, "a sine of the current")
    driver = build_driver(scenario, bundled_scenarios())
    levels = command_sequences(scenario)[0]
    signals, outcome, *_ = play(scenario, driver, levels, open_driver(driver, scenario), lambda: False)
    if outcome.fault is not None:
        raise RunError(f"{plant}, {frequency_hz} Hz: {outcome.fault}: {outcome.message}")
    return Recorded(signals["current"], signals["resistance"], signals["deflection"])


def estimates_of(job: Identification, kappa: float, rows: Recorded) -> dict[str, FloatArray]:
    """Return the deflection (n,) [um] by each of `KINDS`."""
    model = model_of(job.model)
    built: dict[str, Estimator] = {
        kind: RateTermEstimator(model, kappa) if "rate" in kind else BUILDERS[kind](model) for kind in KINDS
    }
    return {
        kind: np.array([one.value for one in estimated_by(estimator, rows, PERIOD_S)])
        for kind, estimator in built.items()
    }


def sensing_errors(job: Identification, kappa: float, frequency_hz: float, seed: int) -> dict[str, float]:
    """Return the mean absolute error of each of `KINDS` [% of the model's range]."""
    rows = sine(job.plant, frequency_hz, seed)
    first = round(1.0 / frequency_hz / PERIOD_S)
    width = model_of(job.model).deflection.width
    return {
        kind: 100.0 * float(np.abs(values - rows.deflection_um)[first:].mean()) / width
        for kind, values in estimates_of(job, kappa, rows).items()
    }


def _verdict(rows: list[tuple[str, ...]]) -> str:
    """Describe the benefit of the rate term at the highest frequency, and the remaining error."""
    fastest = [row for row in rows if row[1] == rows[-1][1]]

    def value(row: tuple[str, ...], kind: str) -> float:
        return float(row[2 + KINDS.index(kind)].split()[0])

    report = [
        f"{value(row, 'gap_free'):.2f} to {value(row, KINDS[2]):.2f} % at a lag of {row[0]} ms"
        for row in fastest
    ]
    return (
        f"At {rows[-1][1]} Hz the term changes the gap-free composite's mean error from {', '.join(report)}."
    )


def _kappa_table(lags: Sequence[float], kappas: dict[tuple[float, int], float]) -> Table:
    rows = []
    for lag in lags:
        found = [1e6 * kappa for (of, _), kappa in kappas.items() if of == lag]
        expected = 1e6 * EXPANSION_UM_PER_K * HEATING_K_PER_MA2 * 1e-3 * lag
        rows.append((f"{lag:g}", spread(found, 1), f"{expected:.1f}"))
    return Table(
        title="The rate term kappa [1e-6 um s/mA²]",
        headers=("lag of the device [ms]", "identified", "expansion x heating x lag"),
        rows=tuple(rows),
        numbers=(0, 1, 2),
    )


def _error_table(rows: list[tuple[str, ...]]) -> Table:
    return Table(
        title="Self-sensing error on sines: mean, least and largest of the seeds [% of range]",
        headers=("lag of the device [ms]", "frequency [Hz]", *KINDS),
        rows=tuple(rows),
        numbers=tuple(range(2 + len(KINDS))),
    )


def _drawn(
    run: Run,
    jobs: dict[tuple[float, int], Identification],
    kappas: dict[tuple[float, int], float],
    lag: float,
) -> Picture:
    seed = seeds(run)[0]
    rows = sine(jobs[lag, seed].plant, FREQUENCIES_HZ[-1], seed)
    found = estimates_of(jobs[lag, seed], kappas[lag, seed], rows)
    part = slice(-round(SHOWN_S / PERIOD_S), None)
    figure = errors_figure(
        PERIOD_S * np.arange(len(rows.current_mA), dtype=np.float64)[part],
        {"measured deflection": rows.deflection_um[part]},
        {kind: (values - rows.deflection_um)[part] for kind, values in found.items()},
        labels=("deflection [µm]", "self-sensing error [µm]"),
        title=f"Device A with its film {lag:g} ms behind, 30 Hz: what a rate term takes away",
    )
    save_small_png(figure, run.pictures / "rate-term.png")
    return Picture(
        file="rate-term.png",
        caption=f"A device like A whose film lags by {lag:g} ms, 30 Hz: deflection and the error of four estimators.",
        alt="Deflection at 30 Hz above, self-sensing errors with and without a rate term below",
    )
