"""Recordings that rtctl itself made through a driver: their columns have the signals' names, their drive was held.

Beside what was measured, a run records what was computed of it, such as an estimate in the unit of the deflection.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TypeVar

from rtctl.measured.proposal.survey import Survey

PROGRAM = 'attribute "program"'
OF_RUNS, OF_ACQUISITIONS = 'attribute "scenario"', 'attribute "driver"'
"""Texts that the recordings of runs and of acquisitions have; simulations have none of them."""
FEWEST_SIGNALS = 2
COMPUTED = "what rtctl computed, counted or commanded beside the signals that it recorded"
T = TypeVar("T")


def is_own_recording(texts: Mapping[str, str]) -> bool:
    """Return whether a file says that rtctl recorded it from a device.

    Args:
        texts: What the file says in words, by where it stands.
    """
    return is_own_run(texts) or (_says(texts, "acquire") and OF_ACQUISITIONS in texts)


def is_own_run(texts: Mapping[str, str]) -> bool:
    """Return whether a file says that it is the recording of a run of rtctl."""
    return _says(texts, "run") and OF_RUNS in texts


def _says(texts: Mapping[str, str], command: str) -> bool:
    """Return whether a file says that a command of rtctl wrote it; earlier versions named the program alone."""
    program = texts.get(PROGRAM, "")
    return program == "rtctl" or program.startswith(f"rtctl {command} ")


def without_computed(
    survey: Survey, candidates: Mapping[str, T], signals: Collection[str]
) -> tuple[dict[str, T], dict[str, str]]:
    """Return the columns that may be signals, and those of an own recording that are none, with the reason.

    Args:
        survey: The file.
        candidates: Columns that may be signals.
        signals: Names of the plant's signals; an own recording with one of them or none keeps all columns.
    """
    named = {name: one for name, one in candidates.items() if name in signals}
    if not is_own_recording(survey.texts) or len(named) < FEWEST_SIGNALS:
        return dict(candidates), {}
    return named, {name: COMPUTED for name in candidates if name not in named}
