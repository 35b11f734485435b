"""Runs as a person reads them in a terminal: one run, and a table of all scenarios."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rtctl.api.runs.recordings import Replayed
from rtctl.evaluation.summary import verdict_in_words
from rtctl.export.c.proof.comparison import Proof
from rtctl.output.readable_units import readable
from rtctl.output.tables import print_table

SMALL_UM = 0.01
"""Errors below it are told in the unit that fits them [um]."""


def um_and_percent(um: float | None, percent: float | None) -> str:
    """Return `0.123 um, 0.22 %`, or a dash where there was nothing to score."""
    if um is None or percent is None:
        return "–"
    return f"{um:.3f} um, {percent:.2f} %" if um >= SMALL_UM else f"{readable(um, 'um', 3)}, {percent:.2f} %"


def error_text(errors: Mapping[str, Any], figure: str) -> str:
    """Return a figure of a summary's errors, such as "mean_abs", in its unit and in percent."""
    if f"{figure}_um" in errors:
        return um_and_percent(errors[f"{figure}_um"], errors[f"{figure}_percent"])
    value, percent = errors[figure], errors[f"{figure}_percent"]
    return "–" if value is None else f"{value:.4g} {errors['unit']}, {percent:.2f} %"


def number(value: float | None, digits: int = 0) -> str:
    """Return a figure, or a dash where it is missing."""
    return "–" if value is None else f"{value:.{digits}f}"


def print_summary(summary: Mapping[str, Any], tuning: str | None, folder: Path) -> None:
    """Print errors, checks, tuning and timing of one run."""
    outputs: Mapping[str, Mapping[str, Any]] = summary.get("outputs") or {"": summary}
    rows = []
    for output, figures in outputs.items():
        for name in ("tracking", "self_sensing"):
            errors = [error_text(figures[name], figure) for figure in ("mean_abs", "max_abs")]
            paper = summary["paper"].get(f"{name}_mean")
            title = f"{output} {name.replace('_', '-')}".strip()
            rows.append([title, *errors, "–" if paper is None else f"{paper:g} %"])
    print_table(
        f"{summary['scenario']}: {verdict_in_words(summary)}",
        ["", "mean abs", "max abs", "paper, mean"],
        rows,
    )
    _print_steps(summary.get("step_response"))
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
    if disagreed := summary.get("readings_disagreed"):
        print(
            f"{disagreed} of {summary['timing']['steps']} readings were implausible to the estimator, far beyond its "
            "errors, and counted for little (estimate_status 16)"
        )
    if tuning is not None:
        print(tuning)
    _print_timing(summary)
    print(f"results in {folder}")


def _print_timing(summary: Mapping[str, Any]) -> None:
    """Print how the steps kept time; live also how late they were, and what the machine refused."""
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


def _print_steps(steps: Mapping[str, Any] | None) -> None:
    """Print settling time, overshoot and settled error of the steps of a run."""
    if not steps:
        return
    settling, overshoot, error = steps["settling_ms"], steps["overshoot_percent"], steps["settled_error"]
    unit, count = error["unit"], steps["steps"]
    rows = [
        ["overshoot, of the step", *(f"{overshoot[which]:.2g} %" for which in ("median", "max"))],
        ["settled error", *(readable(error[which], unit, 3) for which in ("median", "max"))],
    ]
    if settling is not None:
        times = (readable(1e-3 * settling[which], "s", 3) for which in ("median", "max"))
        rows.insert(0, [f"settling, to {steps['band_percent']:g} % of the step", *times])
    print_table(f"{count} step{'s' if count != 1 else ''}", ["", "median", "largest"], rows)
    if steps["settled"] < count:
        print(f"not settled by the end of the hold: {count - steps['settled']} of {count}")


def _print_levels(levels: Sequence[Mapping[str, float | None]]) -> None:
    """Print a row for each settled level, columns as the summary names them."""
    if levels:
        rows = [[number(value, 4) for value in level.values()] for level in levels]
        print_table("settled levels, means", [name.replace("_", " ") for name in levels[0]], rows)


def print_scenarios(summaries: Sequence[Mapping[str, Any]]) -> None:
    """Print one row for each scenario, the paper's figure beside ours."""
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
            verdict_in_words(summary),
        ])  # fmt: skip
    headers = [
        "scenario", "tracking mean", "self-sensing mean", "self-sensing max", "paper", "exchange us", "verdict",
    ]  # fmt: skip
    title = "errors against the reference deflection, um and percent of range; round trips p50 / p99"
    print_table(title, headers, rows)


def print_replay(replayed: Replayed) -> None:
    """Print whether a run came out the same, and where it first did not."""
    first = replayed.first
    if first is None:
        print(
            f"{replayed.rows} samples replayed: estimates, terms and commands are the recorded ones, to the bit"
        )
        return
    print(
        f"{replayed.rows} samples replayed; they differ first at sample {first.index}: {first.column} was "
        f"{first.recorded!r}, is {first.replayed!r}"
    )
    for name, rows in replayed.differing.items():
        print(f"  {name}: {rows} samples differ")


def print_proof(proof: Proof) -> None:
    """Print on which machines an exported loop computed a run to the bit, and what single precision costs."""
    rows = [
        [
            one.machine,
            one.precision,
            one.skipped or ("to the bit" if not one.differing else f"{one.differing} differ"),
        ]
        for one in proof.computed
    ]
    print_table(f"{proof.rows} samples", ["machine", "precision", "as Python computes it"], rows)
    for one in proof.computed:
        if one.first:
            print(f"{one.machine}, {one.precision}: first {one.first}")
    most = {}
    for name, figures in proof.deviations.items():
        key = next(one for one in figures if one.startswith("max_") and one != "max_percent")
        most[name] = readable(figures[key], key.removeprefix("max_"), 2)
    others = ", ".join(
        f"{name.replace('_', ' ')} by {size}" for name, size in most.items() if name != "estimate"
    )
    print(
        f"single precision: the estimate is off by {most['estimate']} at most, "
        f"{proof.deviations['estimate']['max_percent']:.2g} % of the range; the {others} at most"
    )
