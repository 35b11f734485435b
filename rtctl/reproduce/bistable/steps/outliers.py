"""Foreign records: by the paper's threshold, by the residual beyond the noise, and by the diagnosis."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.plots.elements.style import BLACK, VERMILION
from rtctl.plots.reproduce_bistable import draw, portrait
from rtctl.reproduce.bistable.collected import Collected, collected
from rtctl.reproduce.bistable.diagnosed import SECONDS, diagnosed, write_records
from rtctl.reproduce.bistable.models import model_file
from rtctl.reproduce.bistable.protocol import SECOND, record
from rtctl.reproduce.bistable.regression import CUBIC, QUINTIC, determination, least_squares, squared_error
from rtctl.reproduce.bistable.steps.global_fit import global_models
from rtctl.reproduce.bistable.steps.local_fit import THRESHOLD, kept
from rtctl.reproduce.study import Comparison, Picture, Row, Run, Section, Table

BEYOND = 1.5
"""Multiple of the median residual over all records above which a record is foreign.

The residual from the sensor's noise is the same in each record, to a few per cent.
"""
SETS = (11.75, 9.25)
SHORT_MECHANISMS = ("mode.second", "stiffness.quadratic", "damping.quadratic")


def left_over(found: Collected) -> FloatArray:
    """Return the mean square (records,) [mm^2/s^4] of each record's filtered acceleration beyond its own quintic."""
    return np.array(
        [squared_error(gram, least_squares(gram, QUINTIC)) / gram[-1, -1] for gram in found.filtered]
    )  # fmt: skip


def outliers(run: Run) -> Section:
    """Return the section on section 3.4 of the paper, and beyond it."""
    found = collected(run)
    left = left_over(found)
    beyond = left > BEYOND * float(np.median(left))
    dropped = ~kept(found)
    _pictures(run, found, left)
    model = model_file(global_models(found)["weak form"].beam)
    answers = {at: answer for at in SETS if (answer := _diagnosed(run, found, at, beyond, model)) is not None}
    marks = {
        "R² of a local model below 0.84 (the paper's)": dropped,
        "left beyond 1.5 times the noise": beyond,
    }
    table = tuple(
        (name, str(int((mark & found.second_mode).sum())), str(int((~mark & found.second_mode).sum())),
         str(int((mark & ~found.second_mode).sum())))
        for name, mark in marks.items()
    )  # fmt: skip
    strongest = _scaled(found, dropped, beyond)
    named = answers.get(SETS[0], {})
    cause = named.get("causes") or [{}]
    values = cause[0].get("parameters", {})
    right = cause[0].get("id") == "mode.second"
    rows = (
        Row(quantity="records dropped", unit="", paper=23, ours=int(dropped.sum())),
        Row(quantity="second mode's frequency, diagnosis at 11.75 Hz", unit="Hz", paper=None,
            ours=values["frequency"]["value"] if right else None, note=f"truth {SECOND.frequency_hz:g}"),
        Row(quantity="probability of mode.second there", unit="", paper=None,
            ours=cause[0].get("probability") if right else None),
        Row(quantity="error of simulation before over after, test records", unit="", paper=None,
            ours=named.get("gain", {}).get("ratio"), note=named.get("verdict", "no such records")),
    )  # fmt: skip
    return Section(
        title="Outliers: a threshold, the noise, the diagnosis",
        text="The paper drops what scores below a threshold that it calls more or less arbitrary. R² compares "
        "what is left "
        "with the size of the motion; what is left of a good model is the sensor's noise, the same in all "
        "records, so the "
        "records themselves tell how much that is, and a motion's size does not matter. "
        + strongest
        + "\n\nWhat is foreign then goes to the diagnosis, as `rtctl diagnose` would be given it: flagged "
        "records of one "
        f"frequency, {SECONDS:g} s each at 1 kHz, the model being the weak form's quintic. "
        + " ".join(_told(at, answer) for at, answer in answers.items()),
        parts=(
            Comparison(title="Second mode", rows=rows),
            Table(title="Second modes found, missed, and others dropped with them",
                  headers=("criterion", "found", "missed", "others dropped"), rows=table, numbers=(1, 2, 3)),
            Picture(file="fig09-outlier.png", alt="Phase portrait of an outlier, and what is left of each record",
                    caption="Left, as figure 9: the phase portrait of a record with the second mode. Right: what each "
                    "record's own quintic leaves, over R²: the noise is one line, small motions score low all "
                    "the same."),
        ),
    )  # fmt: skip


def _scaled(found: Collected, dropped: NDArray[np.bool_], beyond: NDArray[np.bool_]) -> str:
    """Describe the results of the two criteria in words."""
    foreign = found.second_mode
    by_r2 = int((dropped & foreign).sum()), int((dropped & ~foreign).sum())
    by_noise = int((beyond & foreign).sum()), int((beyond & ~foreign).sum())
    return (
        f"Of {int(foreign.sum())} records with a second mode the threshold finds {by_r2[0]} and drops "
        f"{by_r2[1]} others; "
        f"the noise finds {by_noise[0]} and drops {by_noise[1]} others."
    )


def _diagnosed(
    run: Run, found: Collected, at: float, beyond: NDArray[np.bool_], model: Any
) -> dict[str, Any] | None:
    """Return the answer on up to four flagged records at one frequency; None where there are fewer than two."""
    settings = found.campaign.settings
    chosen = [one for one, own in zip(settings, beyond, strict=True) if own and one.frequency_hz == at][:4]
    if len(chosen) < 2:
        return None
    folder = run.out / f"diagnosis-{at:g}hz"
    folder.mkdir(exist_ok=True)
    records = [record(found.campaign, one) for one in chosen]
    seconds = min(SECONDS, found.campaign.record_s - 0.1)
    manifest = write_records(folder, records, seconds, len(records) // 2)
    return diagnosed(manifest, model, SHORT_MECHANISMS if run.short else None)


def _told(at: float, answer: dict[str, Any]) -> str:
    causes = " ".join(cause["statement"] for cause in answer["causes"])
    gain = answer["gain"]
    if not causes:
        return f"At {at:g} Hz it says {answer['verdict']} and names nothing."
    return (
        f"At {at:g} Hz it says {answer['verdict']}: {causes} (The error of simulation falls from "
        f"{gain['before']:.3g} to "
        f"{gain['after']:.3g} mm on records that were not fitted; noise {gain['noise_floor']:.2g} mm.)"
    )


def _pictures(run: Run, found: Collected, left: FloatArray) -> None:
    scores = np.array([determination(gram, least_squares(gram, CUBIC)) for gram in found.filtered])
    worst = int(np.argmax(np.where(found.second_mode, left, 0.0)))

    def fill(axes: list[Axes]) -> None:
        z, v = found.tail[worst]
        at = found.frequency_hz[worst]
        portrait(axes[0], [("record", z[:1000], v[:1000])], f"a record at {at:g} Hz with the second mode")
        for foreign, color, words in (
            (False, BLACK, "first mode only"),
            (True, VERMILION, "second mode too"),
        ):
            mine = found.second_mode == foreign
            axes[1].plot(
                scores[mine], np.sqrt(left[mine]) / 1000.0, "o", color=color, markersize=3.5, label=words
            )
        axes[1].axvline(THRESHOLD, color="0.5", linewidth=0.8)
        axes[1].set_xlabel("R² of the local cubic model")
        axes[1].set_ylabel("left of the acceleration [m/s²]")
        axes[1].set_yscale("log")
        axes[1].legend()

    draw(run.pictures / "fig09-outlier.png", (9.0, 3.4), (1, 2), fill)
