"""The table of a trial over the wire: a row a case."""

from __future__ import annotations

from statistics import median
from typing import Any

HEADS = (
    "device",
    "hidden",
    "exits that are not 0",
    "verdict",
    "causes",
    "judged",
    "tracking before → after [um]",
    "s",
)


def table(cases: list[dict[str, Any]]) -> str:
    """Markdown table of cases as `wire_trial.Case` has them, with the counts below."""
    lines = ["| " + " | ".join(HEADS) + " |", "|" + "---|" * len(HEADS)]
    lines += ["| " + " | ".join(_row(case)) + " |" for case in cases]
    ratios = [ratio for case in cases for ratio in loop_ratios(case)]
    right = sum(case["outcome"] == "right" for case in cases)
    lines += ["", f"{right} of {len(cases)} right."]
    if ratios:
        lines[-1] += f" Tracking after over before: median {median(ratios):.2f}, worst {max(ratios):.2f}."
    return "\n".join(lines) + "\n"


def loop_ratios(case: dict[str, Any]) -> list[float]:
    """Tracking error after over before, of each loop that ran both times."""
    return [case["after"][name] / case["before"][name] for name in case["after"] if name in case["before"]]


def _row(case: dict[str, Any]) -> list[str]:
    told = case["device"]
    step = f", {told['resistance_step_ohm']:g} ohm steps" if told["resistance_step_ohm"] else ""
    device = (
        f"{case['seed']}: {told['style']}, {1e3 * told['time_constant_s']:.1f} ms, {told['convention']}{step}"
    )
    hidden = case["effect"] if case["effect"] == "none" else f"{case['effect']} ({100 * told['share']:.0f} %)"
    exits = ", ".join(f"{step['name']} {step['exit']}" for step in case["steps"] if step["exit"]) or "–"
    causes = "; ".join(_cause(cause) for cause in case["causes"]) or "–"
    loops = ", ".join(
        f"{name} {error:.2f} → {case['after'][name]:.2f}" if name in case["after"] else f"{name} {error:.2f}"
        for name, error in case["before"].items()
    )
    seconds = f"{sum(step['seconds'] for step in case['steps']):.0f}"
    return [device, hidden, exits, case["verdict"] or "–", causes, case["outcome"], loops or "–", seconds]


def _cause(cause: dict[str, Any]) -> str:
    others = cause.get("indistinguishable_from") or []
    beside = f" or {', '.join(others)}" if others else ""
    sure = cause.get("probability")
    return cause["id"] + beside + ("" if sure is None else f" {100 * sure:.1f} %")
