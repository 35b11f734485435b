"""How a run stands, and once it has ended its verdict in words."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rtctl.evaluation.summary import verdict_in_words
from rtctl.output.readable_units import printed_unit, readable

WORDS = {
    "waiting": "waiting for the first sample",
    "recording": "running",
    "ending": "ended; its files are being written",
    "killed": "killed: the process ended without a word; its rows are whole (rtctl recover makes files of them)",
    "ended": "ended",
}


def words_of(state: str, why_no_row: str | None) -> str:
    """Return a state in words; `why_no_row` is None where rows are shown, else why there are none ("": not known)."""
    if why_no_row is None or state not in ("killed", "ended"):
        return WORDS[state]
    if state == "killed":
        return "killed: the process ended without a word before its first sample; nothing was recorded"
    return f"ended, and there is no sample to show{f' ({why_no_row})' if why_no_row else ''}"


def verdict_of(folder: Path) -> dict[str, Any] | None:
    """Return verdict and sentences of the `summary.json` in `folder`; None: there is none."""
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        return {"verdict": verdict_in_words(summary), "lines": _lines(summary)}
    except (OSError, ValueError, KeyError, TypeError):  # not there yet, or not written by rtctl run
        return None


def _lines(summary: Mapping[str, Any]) -> list[str]:
    """Return a summary's errors, checks that were not met, missed periods and faults, a sentence each."""
    lines = []
    for name in ("tracking", "self_sensing"):
        errors, unit = summary[name], summary[name].get("unit", "um")
        mean, largest = (errors.get(f"{one}_um", errors.get(one)) for one in ("mean_abs", "max_abs"))
        if mean is not None:
            words = printed_unit(f"mean {readable(mean, unit, 3)}, largest {readable(largest, unit, 3)}")
            lines.append(f"{name.replace('_', '-')} error: {words}")
    for check in summary["checks"]:
        if check["met"] is False:
            lines.append(f"not met: {check['check']} = {check['measured']:.4g}, at most {check['limit']:g}")
    if missed := summary["timing"]["overruns"]:
        lines.append(f"missed periods: {missed}")
    return lines + [_fault(fault) for fault in summary.get("faults", ())]


def _fault(fault: Any) -> str:
    if not isinstance(fault, Mapping):
        return f"fault: {fault}"
    return f"fault: {fault.get('fault', '')}: {fault.get('message', '')}"
