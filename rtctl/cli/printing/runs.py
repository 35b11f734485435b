"""What the verbs print: tables of a run, of a model and of all scenarios, and the picture of an identification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.extras import can_draw
from rtctl.identification.vo2.staircase import extract_steady_states
from rtctl.measured.dataset import Dataset
from rtctl.models.vo2 import Vo2Model
from rtctl.output.progress import print_table
from rtctl.plants.support import Tuning


def um_and_percent(um: float | None, percent: float | None) -> str:
    """`0.123 um, 0.22 %`, or a dash where there was nothing to score."""
    return "–" if um is None or percent is None else f"{um:.3f} um, {percent:.2f} %"


def error_text(errors: Mapping[str, Any], figure: str) -> str:
    """Return a figure of a summary's errors, such as "mean_abs", in its unit and in percent."""
    if f"{figure}_um" in errors:
        return um_and_percent(errors[f"{figure}_um"], errors[f"{figure}_percent"])
    value, percent = errors[figure], errors[f"{figure}_percent"]
    return "–" if value is None else f"{value:.4g} {errors['unit']}, {percent:.2f} %"


def number(value: float | None, digits: int = 0) -> str:
    """A figure that may be missing."""
    return "–" if value is None else f"{value:.{digits}f}"


def print_summary(summary: Mapping[str, Any], tuning: Tuning | None, folder: Path) -> None:
    """One run."""
    rows = []
    for name in ("tracking", "self_sensing"):
        errors = summary[name]
        mean = error_text(errors, "mean_abs")
        largest = error_text(errors, "max_abs")
        paper = summary["paper"].get(f"{name}_mean")
        rows.append([name.replace("_", "-"), mean, largest, "–" if paper is None else f"{paper:g} %"])
    print_table(
        f"{summary['scenario']}: {summary['verdict']}", ["", "mean abs", "max abs", "paper, mean"], rows
    )
    _print_levels(summary.get("levels", []))
    for check in summary["checks"]:
        if check["met"] is None:
            print(f"not checked: {check['check']}: the device gave no reference reading")
        elif not check["met"]:
            print(
                f"check not met: {check['check']} = {number(check['measured'], 3)}, at most {check['limit']:g}"
            )
    if summary["clamped_steps"]:
        print(
            f"the device clamped its command in {summary['clamped_steps']} steps: its own limits are narrower than "
            "[limits], and the estimator believes what was commanded"
        )
    if tuning is not None:
        print(tuning.describe())
    _print_timing(summary)
    print(f"results in {folder}")


def _print_timing(summary: Mapping[str, Any]) -> None:
    """How the steps kept time; live also how late they were, and what the machine refused."""
    timing = summary["timing"]
    trip, compute = timing["round_trip_us"], timing["compute_us"]
    print(
        f"{timing['steps']} steps of {1e3 * timing['period_s']:g} ms, {summary['clock']}, {summary['driver']}: "
        f"round trip p50 {number(trip['p50'])} us, p99 {number(trip['p99'])} us; "
        f"compute p50 {number(compute['p50'], 1)} us; {timing['overruns']} periods missed"
    )
    if summary["clock"] == "live":
        late = timing["lateness_us"]
        print(
            f"late p50 {number(late['p50'], 1)} us, p99 {number(late['p99'], 1)} us, p99.9 "
            f"{number(late['p99_9'], 1)} us, at most {number(late['max'])} us; missed periods: {timing['missed']}"
        )
        for request in timing["requests"]:
            if not request["applied"]:
                print(f"{request['name']}: not applied, {request['note']}")


def _print_levels(levels: Sequence[Mapping[str, float | None]]) -> None:
    """A row a settled level, columns as the summary names them."""
    if levels:
        rows = [[number(value, 4) for value in level.values()] for level in levels]
        print_table("settled levels, means", [name.replace("_", " ") for name in levels[0]], rows)


def print_model(model: Vo2Model, path: Path) -> None:
    """How well each part of a model fits."""
    rows = [
        [name, f"{q.mean_abs:.4g} {q.unit}", f"{100 * q.mean_abs / q.range:.2f} %", f"{q.max_abs:.4g} {q.unit}",
         f"{100 * q.max_abs / q.range:.2f} %", f"{q.rms:.4g} {q.unit}"]
        for name, q in model.quality.items()
    ]  # fmt: skip
    headers = ["fit on the identification data", "mean abs", "of range", "max abs", "of range", "rms"]
    print_table(f"model of {model.identity or 'the device'}", headers, rows)
    known = np.isfinite(model.time_constant_error_s)
    error = f"+- {1e3 * model.time_constant_error_s:.2g} ms" if known else "(nominal: the data do not tell)"
    print(
        f"heating time constant {1e3 * model.time_constant_s:.4g} ms {error}; "
        f"deflection {model.deflection.low:.2f} to {model.deflection.high:.2f} um, resistance "
        f"{model.resistance.low / 1e3:.2f} to {model.resistance.high / 1e3:.2f} kohm"
    )
    print(f"wrote {path}")


def print_scenarios(summaries: Sequence[Mapping[str, Any]]) -> None:
    """One row a scenario, the paper's figure beside."""
    rows = []
    for summary in summaries:
        tracking, sensing, paper = summary["tracking"], summary["self_sensing"], summary["paper"]
        theirs = paper.get("tracking_mean", paper.get("self_sensing_mean"))
        rows.append([
            summary["scenario"],
            error_text(tracking, "mean_abs"),
            error_text(sensing, "mean_abs"),
            error_text(sensing, "max_abs"),
            "–" if theirs is None else f"{theirs:g} %",
            " / ".join(number(summary["timing"]["round_trip_us"][p]) for p in ("p50", "p99")),
            summary["verdict"],
        ])  # fmt: skip
    headers = [
        "scenario", "tracking mean", "self-sensing mean", "self-sensing max", "paper", "exchange us", "verdict",
    ]  # fmt: skip
    title = "errors against the reference deflection, um and percent of range; round trips p50 / p99"
    print_table(title, headers, rows)


def draw_model(path: Path, dataset: Dataset, model: Vo2Model) -> None:
    """Measured staircase against the models."""
    if not can_draw():
        return
    from rtctl.plots import plot_identification

    ends = extract_steady_states(dataset)
    v = ends.current_mA
    second = np.flatnonzero(ends.reset)[1:2]  # the first staircase is drawn: random ones would be a scribble
    scored = ends.scored & (np.arange(len(v)) < (second[0] if len(second) else len(v)))
    models = {
        "GPI / EGPI": (
            -1e3 * model.resistance_gpi.simulate(v)[scored],
            model.deflection_egpi.simulate(v)[scored],
        ),
        "Preisach": (
            np.exp(-model.resistance_preisach.simulate(v)[scored]),
            model.deflection_preisach.simulate(v)[scored],
        ),
    }
    plot_identification(path, v[scored], ends.resistance_ohm[scored], ends.deflection_um[scored], models)
