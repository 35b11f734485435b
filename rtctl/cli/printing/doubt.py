"""Findings of `rtctl doubt` as lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rtctl.doubt.watch import LEARNED, WINDOW_S, Finding


def finding_line(finding: Finding, done: str) -> str:
    """Return a finding as a line: after which sample, since which, what, what was done."""
    acted = f"; {done}" if done else ""
    return f"sample {finding.sample} (since {finding.since}): {finding.kind}: {finding.message}{acted}"


def _verdict(windows: int, compared: int, found: int) -> str:
    """Return what is known of the device, and from how much."""
    length = f"windows of {WINDOW_S:g} s"
    if not compared and not found:
        return (
            f"nothing is known of the device: the first {LEARNED + 1} {length} are warm-up and past, and this run has "
            f"{windows}; run for longer than {(LEARNED + 2) * WINDOW_S:g} s"
        )
    told = f"{found} finding{'s' if found > 1 else ''}" if found else "no change of the device was seen"
    return f"{told}: {compared} of {windows} {length} were compared with those before"


def summary_lines(summary: Mapping[str, Any]) -> list[str]:
    """Return the last lines: how much was seen, and what could not be."""
    found = sum(one["kind"] not in ("learned", "named") for one in summary["findings"])
    lines = [_verdict(summary["windows"], summary["windows_compared"], found)]
    if summary["windows_too_still"]:
        lines.append(
            f"in {summary['windows_too_still']} of them the device hardly moved: how it answers could not be seen"
        )
    for way, told in summary["isolability"].items():
        pairs = ", ".join(f"{one} and {other}" for one, other in told["alike"])
        lines.append(f"small changes that look alike, by {way}: {pairs or 'none'}")
    return lines
