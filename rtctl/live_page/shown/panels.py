"""Panels and planes of the page, from the roles and units of its signals."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from rtctl.live_page.shown.signals import ShownSignals, Signal

ROLES = (
    ("Output", ("setpoint", "measured", "estimate", "band")),
    ("Error", ("error", "sensing_error")),
    ("Command", ("command",)),
    ("Reading", ("reading",)),
    ("Terms of the controller", ("term",)),
    ("Inside the estimator", ("surrogate",)),
    ("Signals", ("signal",)),
)
"""Titles of the panels from top to bottom, and the roles that each shows; a panel for each unit."""


def panels_of(shown: ShownSignals) -> list[dict[str, Any]]:
    """Return the time charts: title, unit and the numbers of their signals."""
    panels = []
    for title, roles in ROLES:
        units: dict[str, list[int]] = {}
        for number, signal in enumerate(shown.signals):
            if signal.role in roles:
                units.setdefault(signal.unit, []).append(number)
        for unit, numbers in units.items():
            names = [shown.signals[number].name for number in numbers]
            whole = _words(shown.output) if title == "Output" else title
            several = len(units) > 1 or title == "Signals"
            panels.append({
                "title": ", ".join(map(_words, names)) if several and len(names) < 3 else whole,
                "unit": unit,
                "signals": numbers,
            })  # fmt: skip
    return panels


def planes_of(shown: ShownSignals, metadata: Mapping[str, str]) -> list[dict[str, Any]]:
    """Return the planes: the signal across, and the signals up, each in the unit of the first.

    The last command against the first reading and the output; readings against each other, or the only one against
    the output. Of a VO2 actuator these are R–I, D–I and D–R. Of a dataset: every input against every output.
    """
    by_role: dict[str, list[int]] = {}
    for number, signal in enumerate(shown.signals):
        by_role.setdefault(signal.role, []).append(number)
    outputs = [*by_role.get("measured", ()), *by_role.get("estimate", ())]
    commands, readings = by_role.get("command", []), by_role.get("reading", [])
    if not commands or not readings:
        return _of_a_dataset(shown.signals, json.loads(metadata.get("inputs", "[]")))
    across = readings[1:2] or outputs
    found = [(commands[-1], readings[:1]), (commands[-1], outputs), (readings[0], across)]
    return [{"x": x, "y": y} for x, y in found if y]


def _of_a_dataset(signals: Sequence[Signal], inputs: Sequence[str]) -> list[dict[str, Any]]:
    given = [number for number, signal in enumerate(signals) if signal.name in inputs]
    others = [number for number, signal in enumerate(signals) if signal.name not in inputs]
    return [{"x": x, "y": [y]} for x in given[:1] for y in others[:3]]


def _words(name: str) -> str:
    text = name.replace("_", " ")
    return text[:1].upper() + text[1:]
