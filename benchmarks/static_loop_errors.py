"""What identified loops are off by on foreign devices with nothing hidden, beside what their staircases predict of it.

python benchmarks/static_loop_errors.py --first 200 --last 203 [--style few_domains]

A line for each device: RMS misfit on moving records less the bench's noise, over the cross-validation's prediction, of
the deflection and of ln R (`ON_OTHER_RECORDS` allows 1.5); the largest share of the allowed misfit along the direction
of one mechanism, in units of the noise and by size, without and with `hysteresis.shape` (`allowed_coloured`,
`allowed_correction`, `allowed_by_size`); and the cost of readings at the end of a period over that at its start, with
the truth (`READS_AFTER_ROWS`).
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "foreign"))

from foreign_generate import generate
from foreign_styles import STYLES, draw_bench

from rtctl.diagnosis.nominal_fit.misfit.allowed_misfit import allow_misfit
from rtctl.diagnosis.nominal_fit.nominal_fit import fit_nominal
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_for
from rtctl.diagnosis.residual.testing.analysis import ResidualAnalysis, analyse_residual
from rtctl.diagnosis.residual.testing.metrics import allowed_metrics
from rtctl.diagnosis.screening.screen import screen_dataset
from rtctl.diagnosis.thresholds import Thresholds
from rtctl.identification.vo2.heating import fit_with_readings
from rtctl.identification.vo2.identify import Vo2FitOptions, identify_vo2
from rtctl.measured.reading import read_dataset
from rtctl.plants.vo2.log_resistance import LOG_RESISTANCE
from rtctl.simulations.vo2 import vo2_simulation
from rtctl.wiring_models import mechanism_ids

SHAPE = "hysteresis.shape"
HEAD = (
    "| device | deflection | ln R | coloured | shape | by size | shape | end over start | read at |\n"
    "|---|---|---|---|---|---|---|---|---|"
)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Errors of identified loops on foreign devices.")
    parser.add_argument(
        "--style", choices=STYLES, help="only this one; default: the three that are not kept back"
    )
    parser.add_argument("--first", type=int, required=True)
    parser.add_argument("--last", type=int, required=True)
    given = parser.parse_args()
    print(HEAD)
    for style in [given.style] if given.style else STYLES[:-1]:
        for seed in range(given.first, given.last + 1):
            print(_row(style, seed), flush=True)


def _row(style: str, seed: int) -> str:
    bench = draw_bench(style, seed)
    noise = {
        "deflection": bench.deflection_noise_um,
        LOG_RESISTANCE: float(np.hypot(bench.resistance_noise, bench.resistance_flicker)),
    }
    with tempfile.TemporaryDirectory() as name:
        dataset = read_dataset(generate(style, seed, Path(name)))
    model = identify_vo2(dataset, Vo2FitOptions(plays=2, starts=1), lambda text: None)
    predicted = {
        "deflection": model.deflection_error_elsewhere, LOG_RESISTANCE: model.reading_error_elsewhere
    }  # fmt: skip

    thresholds, subject = Thresholds(), subject_for("vo2", dataset)
    simulation = vo2_simulation(model, dataset.units, "model")
    data = screen_dataset(dataset, simulation, subject, subject.required_signal, thresholds)
    problem = Problem(
        subject=subject, records=data.records.fit, scales=data.scales, thresholds=thresholds,
        steps_per_period=subject.steps_per_period,
    )  # fmt: skip
    first = fit_nominal(problem, data.simulation, lambda text: None)
    problem = allow_misfit(first.problem, subject.stated_misfit(model, dataset))
    analysis = analyse_residual(first.nominal, problem, mechanism_ids("vo2"))

    ratios = {}
    for k, output in enumerate(first.nominal.sensitivity.outputs):
        left = np.concatenate([row.residual[k] for row in analysis.rows])
        beyond = max(float(np.mean(left**2)) - noise[output] ** 2, 0.0)
        promised = predicted[output]
        ratios[output] = "-" if promised is None else f"{np.sqrt(beyond) / promised:.2f}"
    cells = [f"{style} {seed}", ratios["deflection"], ratios[LOG_RESISTANCE]]
    cells += [f"{share:.3f}" for share in _largest_shares(analysis)]

    records = [one for one in dataset.records if one.use != "test"]
    costs = [
        fit_with_readings(
            records,
            model.resistance_preisach,
            model.deflection_preisach,
            model.time_constant_s,
            reads_after=after,
        )[1]
        for after in (False, True)
    ]
    cells += [f"{costs[1] / costs[0]:.2f}", bench.device.convention]
    return "| " + " | ".join(cells) + " |"


def _largest_shares(analysis: ResidualAnalysis) -> list[float]:
    """Return the largest share of an allowed misfit along one direction, in both metrics, without and with shapes."""
    limits = analysis.problem.thresholds.residual
    found = []
    for metric, share in zip(
        allowed_metrics(analysis), (limits.allowed_coloured[0], limits.allowed_by_size[0]), strict=True
    ):
        removed = metric.projected.single()
        for of_shape in (False, True):
            used = max(share, limits.allowed_correction) if of_shape else share
            chosen = [
                k
                for k, one in enumerate(analysis.directions)
                if one.mechanism and (one.mechanism == SHAPE) == of_shape
            ]
            whole = metric.alone[chosen] / used
            found.append(float(np.max(removed[chosen] / np.maximum(whole, 1e-300))))
    return found


if __name__ == "__main__":
    main()
