"""Scores of each output of a loop that controls several."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rtctl.border.arrays import FloatArray
from rtctl.border.equations.controlled import StateSpace
from rtctl.evaluation.metrics import ErrorScore, score
from rtctl.scenario.schema import Scenario


def output_scores(
    scenario: Scenario, model: StateSpace, signals: Mapping[str, FloatArray]
) -> dict[str, tuple[str, ErrorScore, ErrorScore]]:
    """Return unit, tracking and self-sensing errors of each output by name, against its own instrument or reading.

    Args:
        scenario: The checked scenario; without [references] there is nothing to tell.
        model: The model of the run.
        signals: Recorded signals (n,) by name.
    """
    if not scenario.references:
        return {}
    by_name = {one.name: one for one in model.outputs}
    own = scenario.profile.reference.name
    names = {model.outputs[model.shown].name: ("", own)} | {
        name: (f"_{name}", name) for name in scenario.references
    }
    found = {}
    for name, (ending, instrument) in names.items():
        output = by_name[name]
        assert output.reach is not None  # the controller refuses it
        width = output.reach[1] - output.reach[0]
        tracking, sensing = (
            score(signals[f"{word}{ending}"], signals[instrument], width) for word in ("setpoint", "estimate")
        )
        found[name] = output.unit, tracking, sensing
    return found


def to_table(scores: Mapping[str, tuple[str, ErrorScore, ErrorScore]]) -> dict[str, Any]:
    """Return the table of a summary: figures of each output, in its unit and in percent of its range."""
    return {
        name: {"tracking": tracking.to_dict(unit), "self_sensing": sensing.to_dict(unit)}
        for name, (unit, tracking, sensing) in scores.items()
    }
