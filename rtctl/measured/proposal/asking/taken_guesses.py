"""A proposal after a dialogue: a guess that a person took keeps the reason for which it was guessed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from rtctl.measured.proposal.between_rows.hold import SAID
from rtctl.measured.proposal.proposal import Proposal, SignalGuess, TimeGuess


def with_reasons(proposal: Proposal, reasons: Mapping[str, str]) -> Proposal:
    """Return a proposal with the reasons of the guesses that were taken.

    Args:
        proposal: The proposal that follows from all answers.
        reasons: Reason of each guess that was taken, by the key of its question.
    """
    return replace(
        proposal,
        plant_why=reasons.get("plant", proposal.plant_why),
        signals=tuple(_signal(one, reasons) for one in proposal.signals),
        time=_time(proposal.time, reasons),
    )


def _signal(signal: SignalGuess, reasons: Mapping[str, str]) -> SignalGuess:
    return replace(
        signal,
        why=reasons.get(signal.name, signal.why),
        unit_source=reasons.get(f"unit.{signal.name}", signal.unit_source),
        hold_why=reasons.get(f"hold.{signal.name}", signal.hold_why),
    )


def _time(time: TimeGuess, reasons: Mapping[str, str]) -> TimeGuess:
    """Return the time with its reason: that of the column tells its unit too, where both were guessed."""
    if time.column is None:
        return replace(time, why=reasons.get("sample_rate_hz", time.why))
    column, unit = reasons.get("time", SAID), reasons.get("time_unit", SAID)
    if "time" not in reasons and "time_unit" not in reasons:
        return time
    return replace(
        time, why=column if "time_unit" in reasons and unit in column else f"{column}; unit: {unit}"
    )
