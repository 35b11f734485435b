"""Figures 14 to 16: a PI on each estimate, as in the paper; every reference of its text and of its abstract."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rtctl.plots.elements.small_png import save_small_png
from rtctl.plots.reproduce_vo2 import errors_figure
from rtctl.reproduce.study import Comparison, Picture, Row, Run, Section, Table
from rtctl.reproduce.vo2 import paper
from rtctl.reproduce.vo2.bench import (
    ESTIMATORS,
    Scores,
    Trial,
    devices,
    in_parallel,
    length,
    played,
    scored,
    seeds,
    spread,
)
from rtctl.reproduce.vo2.models import Models, models

REFERENCES = {
    "steps": "1 s steps (figure 14)",
    "sine_0p1hz": "0.1 Hz sine (figure 15, the text)",
    "sine_1hz": "1 Hz sine (the abstract)",
    "multisine_1_10hz": "4 sin(2π t) + 6 sin(2π 10 t) + 30 um (figure 16, the text)",
    "multisine_10_30hz": "4 sin(2π 10 t) + 2 sin(2π 30 t) + 30 um (the abstract: 10 and 30 Hz)",
}
SHOWN = {
    "steps": ("fig14-steps.png", 8.0),
    "sine_0p1hz": ("fig15-sine.png", 4.0),
    "multisine_1_10hz": ("fig16-multisine.png", 6.0),
}
"""File and the limit of the error's axis [um]."""
STEPS = "steps"
HOLD_STEPS = 1000
SHOWN_S = {"multisine_1_10hz": 1.2}
Found = dict[tuple[str, str, str], list[Scores]]
"""Scores by (device, reference, estimator), one a seed."""


def compute(run: Run) -> Section:
    """Return the section."""
    paths = models(run, "full")
    found = tracked(run, paths, feedforward=False)
    return Section(
        title="Tracking under every estimator (figures 14 to 16)",
        text=(
            "A PI alone, as in the paper, on each estimate; its gains follow from the identified model (gain margin 2, "
            "phase margin 60 degrees; the paper's gains are lost). Loop at 1 ms. Mean absolute error of the device "
            "against the reference over every sample, the approach from the cold included.\n\n"
            + _steps_and_sine(found)
            + " On the multisines it is not the estimate that is missing but the PI's speed: an integrator that keeps "
            "its margins needs tens of milliseconds across the hysteresis at each reversal, and so the estimators "
            "stand close together and none of them well. The next section takes that on."
        ),
        parts=(
            _beside(found),
            *(table(run, found, name, title) for name, title in references(run).items()),
            _ripples(run, paths),
            *(drawn(run, paths["vo2_a", seeds(run)[0]], name) for name in SHOWN),
        ),
    )


def references(run: Run) -> dict[str, str]:
    """Return all references, or those of which the paper has figures; name to title."""
    return {name: title for name, title in REFERENCES.items() if name in SHOWN or not run.short}


def tracked(run: Run, paths: Models, *, feedforward: bool) -> Found:
    """Run every device, reference and estimator."""
    trials = [
        Trial(name, device, paths[device, seed], kind, seed, length(run, name), feedforward)
        for device in devices(run)
        for name in references(run)
        for kind in ESTIMATORS
        for seed in seeds(run)
    ]
    found: Found = {}
    for trial, score in zip(trials, in_parallel(run, scored, trials), strict=True):
        found.setdefault((trial.device, trial.scenario, trial.estimator), []).append(score)
    return found


def mean_of(scores: list[Scores]) -> float:
    """Return the mean tracking error over the seeds [% of range]."""
    return float(np.mean([one.tracking_mean for one in scores]))


def _steps_and_sine(found: Found) -> str:
    """Return in how many cells each estimator tracks best, for the slow references."""
    cells = [key[:2] for key in found if key[2] == ESTIMATORS[0] and not key[1].startswith("multisine")]
    best = [min((mean_of(found[(*cell, kind)]), kind) for kind in ESTIMATORS)[1] for cell in cells]
    ahead = [mean_of(found[(*cell, "composite")]) < mean_of(found[(*cell, "preisach")]) for cell in cells]
    counts = ", ".join(f"{kind} in {best.count(kind)}" for kind in ESTIMATORS if kind in best)
    return (
        f"On steps and slow sines (device and reference: {len(cells)} cells) the best is {counts}; the paper's "
        f"composite is ahead of Preisach in {sum(ahead)}, in the paper it always is."
    )


def table(run: Run, found: Found, name: str, title: str) -> Table:
    """Return the table of a reference on every device."""
    given = tuple(
        "–" if (name, kind) not in paper.TRACKING else f"{paper.TRACKING[name, kind].mean_percent:.2f}"
        for kind in ESTIMATORS
    )
    return Table(
        title=f"{title}: mean error, least and largest of the seeds [% of range]",
        headers=("device", *ESTIMATORS),
        rows=(
            ("paper", *given),
            *(
                (
                    device,
                    *(spread([s.tracking_mean for s in found[device, name, kind]]) for kind in ESTIMATORS),
                )
                for device in devices(run)
            ),
        ),
        numbers=tuple(range(1, 1 + len(ESTIMATORS))),
    )


def _beside(found: Found) -> Comparison:
    rows = []
    for (name, kind), given in paper.TRACKING.items():
        ours = mean_of(found["vo2_a", name, kind])
        note = "from 20.1 % less than" if (name, kind) == ("multisine_1_10hz", "preisach") else ""
        rows.append(
            Row(quantity=f"{REFERENCES[name]}, {kind}", unit="% of range", paper=given.mean_percent,
                ours=ours, note=note)
        )  # fmt: skip
    return Comparison(title="Device A, mean tracking error beside the paper", rows=tuple(rows))


def _ripples(run: Run, paths: Models) -> Table:
    trials = [
        Trial(STEPS, device, paths[device, seed], kind, seed, length(run, STEPS))
        for device in devices(run)
        for kind in ESTIMATORS
        for seed in seeds(run)
    ]
    found: dict[tuple[str, str], list[float]] = {}
    for trial, ripple in zip(trials, in_parallel(run, settled_ripple, trials), strict=True):
        found.setdefault((trial.device, trial.estimator), []).append(ripple)
    return Table(
        title="Ripple of the deflection on settled steps: rms, least and largest of the seeds [um]",
        headers=("device", *ESTIMATORS),
        rows=tuple(
            (device, *(spread(found[device, kind], 3) for kind in ESTIMATORS)) for device in devices(run)
        ),
        text=(
            "In the second half of each 1 s; the white noise of the instrument, 0.02 um, is in every figure. With "
            "Preisach and with the observer the loop stands still on every device; with each of the others it hunts on "
            "some: on A and B with the paper's composite, whose inverse has to guess the branch between two envelopes."
        ),
        numbers=tuple(range(1, 1 + len(ESTIMATORS))),
    )


def settled_ripple(trial: Trial) -> float:
    """Return the RMS of the deflection about its mean in the second half of each hold, over the holds [um]."""
    _, signals = played(trial)
    holds = signals["deflection"][: len(signals["deflection"]) // HOLD_STEPS * HOLD_STEPS].reshape(
        -1, HOLD_STEPS
    )
    return float(np.sqrt(np.mean(np.var(holds[:, HOLD_STEPS // 2 :], axis=1))))


def drawn(run: Run, path: Path, name: str) -> Picture:
    """Draw a reference on device A, first seed: the paper's two estimators and the observer."""
    file, limit = SHOWN[name]
    shown, errors = {}, {}
    for kind in ("composite", "preisach", "observer"):
        _, signals = played(Trial(name, "vo2_a", path, kind, seeds(run)[0], length(run, name)))
        shown["reference"] = signals["setpoint"]
        if kind != "observer":
            shown[f"deflection, {kind}"] = signals["deflection"]
        errors[kind] = signals["deflection"] - signals["setpoint"]
    time_s = 1e-3 * np.arange(len(shown["reference"]), dtype=np.float64)
    kept = time_s < SHOWN_S.get(name, np.inf)
    figure = errors_figure(
        time_s[kept],
        {label: values[kept] for label, values in shown.items()},
        {label: values[kept] for label, values in errors.items()},
        labels=("deflection [µm]", "tracking error [µm]"),
        title=f"Device A, PI alone: {REFERENCES[name].partition(' (')[0]}",
        error_limit=limit,
    )
    save_small_png(figure, run.pictures / file)
    return Picture(
        file=file,
        caption=f"Device A, PI alone, {REFERENCES[name]}: reference and deflection, and the tracking error.",
        alt=f"Reference, deflection and tracking error of device A for {REFERENCES[name]}",
    )
