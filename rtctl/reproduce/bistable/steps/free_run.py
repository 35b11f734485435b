"""Free simulation: each model from a record's first state under its measured drive, no measured displacement fed in."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus
from rtctl.plots.elements.lines import ABOVE
from rtctl.plots.reproduce_bistable import Cloud, draw, over_frequency
from rtctl.reproduce.bistable.collected import Collected, collected
from rtctl.reproduce.bistable.diagnosed import DECIMATION, signals
from rtctl.reproduce.bistable.models import TRUTH, Beam, model_file
from rtctl.reproduce.bistable.protocol import RATE_HZ, UNITS, record
from rtctl.reproduce.bistable.regression import CUBIC, determination, least_squares
from rtctl.reproduce.bistable.steps.global_fit import global_models
from rtctl.reproduce.study import Comparison, Picture, Row, Run, Section, Table
from rtctl.wiring_models import build_simulation

SECONDS = 20.0
NAMES = ("HM", "local RM", "RM5", "RM5c", "weak form", "truth")
LOST = 0.5
"""Error relative to the record's size above which a simulation is on another orbit."""


def errors(found: Collected, chosen: NDArray[np.int64], seconds: float) -> FloatArray:
    """Return (records, models) RMS errors over the record's RMS about its mean, of the records `chosen`."""
    models = global_models(found)
    reference = build_simulation(model_file(TRUTH), UNITS, "the models")
    names = [parameter.name for parameter in reference.parameters]
    result = []
    for k in chosen.tolist():
        local = least_squares(found.filtered[k], CUBIC).beam
        beams = [local if name == "local RM" else models[name].beam for name in NAMES]
        values = np.array([_values(beam, names) for beam in beams])
        u, z = signals(record(found.campaign, found.campaign.settings[k]), seconds)
        speed = float(np.polyfit(np.arange(9) * DECIMATION / RATE_HZ, z[:9], 3)[-2])
        stimulus = Stimulus(
            inputs={"drive": u}, holds={"drive": "band-limited"}, period_s=DECIMATION / RATE_HZ,
            peak={"displacement": 1.2 * float(np.abs(z).max())},
        )  # fmt: skip
        simulated = reference.predict(stimulus, values, np.array([[z[0], speed]])).outputs["displacement"]
        rms = np.sqrt(np.mean((simulated - z) ** 2, axis=1))
        result.append(rms / z.std())
    return np.array(result)


def _values(beam: Beam, names: list[str]) -> list[float]:
    own = {
        "damping": beam.damping, "stiffness": beam.stiffness, "stiffness_cubic": beam.cubic, "drive_gain": 1000.0,
        "stiffness.quintic.coefficient": beam.quintic,
    }  # fmt: skip
    return [own[name] for name in names]


def freerun(run: Run) -> Section:
    """Return the section on what R^2 of the acceleration does not show."""
    found = collected(run)
    seconds = min(SECONDS, found.campaign.record_s - 0.1)
    regular = (found.periods > 0) & ~found.second_mode
    chosen = np.flatnonzero(regular)
    error = errors(found, chosen, seconds)
    inter = found.ends_through[chosen]
    frequency = found.frequency_hz[chosen]

    def fill(axes: list[Axes]) -> None:
        clouds = [
            Cloud(name, frequency, np.maximum(100.0 * error[:, NAMES.index(name)], 0.01), inter)
            for name in ("HM", "RM5", "weak form")
        ]
        over_frequency(axes[0], clouds, "error of free simulation [% of the motion]")
        axes[0].set_yscale("log")
        axes[0].legend(**ABOVE)

    draw(run.pictures / "free-simulation.png", (7.2, 3.8), (1, 1), fill)
    models = global_models(found)
    rows, table = [], []
    for k, name in enumerate(NAMES):
        own = error[:, k]
        inside, through = (own[inter == kind] for kind in (False, True))
        if name == "local RM":
            scores = [
                determination(found.filtered[j], least_squares(found.filtered[j], CUBIC)) for j in chosen
            ]
        else:
            scores = [determination(found.filtered[j], models[name]) for j in chosen]
        rows.append(
            Row(quantity=f"{name}: median error of free simulation, both wells", unit="%", paper=None,
                ours=_percent(through))
        )  # fmt: skip
        table.append(
            (name, f"{np.median(scores):.4f}", f"{_percent(inside) or np.nan:.3g}",
             f"{_percent(through) or np.nan:.3g}", str(int((own > LOST).sum())))
        )  # fmt: skip
    return Section(
        title="Error of free simulation",
        text=f"Each model from the record's first state under the measured drive for {seconds:g} s, of the "
        f"{len(chosen)} "
        "records whose motion repeats and has no second mode; a chaotic record says nothing here, as "
        "neighbours part in "
        "it. The paper's R² on the acceleration beside it: it ranks models, and hides that a model that "
        "scores 0.99 may "
        "leave the orbit. Where the truth itself is on another orbit the record begins in a chaotic transient.",
        parts=(
            Comparison(title="Free simulation", rows=tuple(rows), text="The paper has no error of simulation."),
            Table(title="R² on the acceleration and error of simulation",
                  headers=("model", "median R²", "error in one well [%]", "error through both [%]", "on another orbit"),
                  rows=tuple(table), numbers=(1, 2, 3, 4)),
            Picture(file="free-simulation.png", alt="Error of free simulation over frequency for three models",
                    caption="RMS error of free simulation over the motion's own RMS, a dot a record."),
        ),
    )  # fmt: skip


def _percent(values: FloatArray) -> float | None:
    return 100.0 * float(np.median(values)) if len(values) else None
