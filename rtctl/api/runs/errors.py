"""Errors of a run as numbers with their unit, whatever the unit is: `ErrorFigures`, `OutputErrors`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from rtctl.evaluation.metrics import LENGTH_UNIT


class ErrorFigures(NamedTuple):
    """Absolute errors over a run, in `unit`; None where no instrument measured anything to score."""

    mean_abs: float | None
    """Mean of the absolute error [unit]."""
    rms: float | None
    """Root of the mean square [unit]."""
    max_abs: float | None
    """Largest absolute error [unit]."""
    unit: str
    """Unit of the three figures above; "um" of every length."""
    mean_abs_percent: float | None = None
    """Mean absolute error in percent of the output's range."""
    rms_percent: float | None = None
    """RMS error in percent of the output's range."""
    max_abs_percent: float | None = None
    """Largest absolute error in percent of the output's range."""


class OutputErrors(NamedTuple):
    """Errors of one output of several."""

    tracking: ErrorFigures
    """How far the output was off its set-point."""
    self_sensing: ErrorFigures
    """How far its estimate was off the output."""


def errors_of_outputs(summary: Mapping[str, Any]) -> dict[str, OutputErrors]:
    """Return the errors of each output of a run by its name; none where its scenario has one output alone."""
    return {
        name: OutputErrors(error_figures(table["tracking"]), error_figures(table["self_sensing"]))
        for name, table in summary.get("outputs", {}).items()
    }


def error_figures(table: Mapping[str, Any]) -> ErrorFigures:
    """Return the figures of a table of `summary.json`, such as "tracking", whose keys of lengths end in their unit."""
    unit = str(table.get("unit", LENGTH_UNIT))
    suffix = "" if "unit" in table else f"_{LENGTH_UNIT}"
    percents = {key: table.get(key) for key in ("mean_abs_percent", "rms_percent", "max_abs_percent")}
    mean_abs, rms, max_abs = (table.get(f"{name}{suffix}") for name in ("mean_abs", "rms", "max_abs"))
    return ErrorFigures(mean_abs, rms, max_abs, unit, **percents)
