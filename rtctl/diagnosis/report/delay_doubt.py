"""A delay is known to half a sample only, as long as nobody knows how the drive goes on between its samples."""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.result import Cause
from rtctl.output.readable_units import readable

DELAY_DOUBT = (
    "{id} is uncertain by half a sample, {half}, beyond its interval as long as it is not known how the {signal} goes "
    'on between its samples: hold = "linear" in the manifest is a guess where nothing shows it, and a drive that a '
    'converter holds ("zero") comes that much later by itself. If it does, write hold = "zero" in [signals.{signal}] '
    "and run rtctl identify and rtctl diagnose again"
)
LATE = ("delay", "skew")
"""Last words of the ids of mechanisms by which something comes late."""


def doubt_delays(causes: Sequence[Cause], problem: Problem) -> list[str]:
    """Return a sentence on each delay that half a sample of another hold may be a part of."""
    if problem.subject.is_steady or any(cause.hold for cause in causes):
        return []
    half = readable(0.5 * max(record.period_s for record in problem.records), "s")
    guessed = [name for name, hold in problem.records[0].stimulus.holds.items() if hold == "linear"]
    said = []
    for cause in causes:
        place, _, law = cause.id.rpartition(".")
        own = [name for name in guessed if place == f"input.{name}"] or guessed
        if law in LATE and own:
            said.append(DELAY_DOUBT.format(id=cause.id, half=half, signal=own[0]))
    return said
