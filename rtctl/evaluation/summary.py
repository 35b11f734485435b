"""The summary of a run: verdict, scores, checks, timing, faults; the content of `summary.json`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.records import DeviceStatus
from rtctl.border.units.quantities import convert
from rtctl.evaluation.metrics import LENGTH_UNIT, NOT_SCORED, ErrorScore, finite, score
from rtctl.evaluation.outputs import output_scores, to_table
from rtctl.evaluation.setpoint_holds import hold_error_percent, holds_of, level_rows, settling_ms
from rtctl.evaluation.step_response import step_responses, summarise_steps
from rtctl.interfaces import EstimateStatus
from rtctl.loop.supervisor import LoopOutcome
from rtctl.plant_control.support import PlantSupport
from rtctl.scenario.schema import Scenario
from rtctl.signals.references import Steps
from rtctl.timing.realtime import Request
from rtctl.timing.step_timing import StepTiming

Measured = dict[str, float | None]
"""The quantity of each check, by its name; None if there was nothing to measure."""


def summarise(
    scenario: Scenario,
    plant: PlantSupport[Any],
    model: Any,
    outcome: LoopOutcome,
    signals: Mapping[str, FloatArray],
    timing: StepTiming,
    requests: Sequence[Request] = (),
) -> dict[str, Any]:
    """Return the summary of a run, with percentages of the model's output range.

    Args:
        scenario: the checked scenario.
        plant: the support of its kind of plant.
        model: the identified model.
        outcome: how the loop ended.
        signals: recorded signals (n,) by name.
        timing: how the loop kept time.
        requests: what came of each real-time request.
    """
    output = scenario.profile.reference
    unit, factor = _summary_unit(output.unit)
    span = factor * plant.output_range(scenario, model).width
    measured = factor * signals[output.name]
    sensing = score(factor * signals["estimate"], measured, span)
    tracking = (
        NOT_SCORED if scenario.reference is None else score(factor * signals["setpoint"], measured, span)
    )
    faults = _faults(outcome)
    levels, held = _levels(scenario, plant, model, signals)
    apart = output_scores(scenario, model, signals)
    checks = _checks(scenario, {**_worst_errors(tracking, sensing, apart), **held})
    failed = [one for one in checks if one["met"] is False]  # None: no instrument, nothing to hold it to
    summary: dict[str, Any] = {
        "scenario": scenario.scenario.title,
        "verdict": "fault" if outcome.fault is not None else "fail" if failed else "pass",
        "tracking": tracking.to_dict(unit),
        "self_sensing": sensing.to_dict(unit),
        **({"range_um": span} if unit == LENGTH_UNIT else {"range": span, "range_unit": unit}),
        **({"outputs": to_table(apart)} if apart else {}),
        "estimator": scenario.estimator.kind,
        "driver": scenario.driver.kind,
        "clock": scenario.clock.mode,
        "device": plant.identity(model),
        "timing": {
            **timing.summary(scenario.scenario.period_s),
            "steps_in": outcome.taken_in,
            "missed": scenario.clock.missed,
            "requests": [request._asdict() for request in requests],
        },
        "clamped_steps": _marked(signals["device_status"], DeviceStatus.CLAMPED),
        "readings_disagreed": _marked(signals["estimate_status"], EstimateStatus.DISAGREES),
        **({"levels": levels} if levels else {}),
        **({"step_response": steps} if (steps := _steps(scenario, signals, factor, unit)) else {}),
        "checked": bool(checks) and all(check["met"] is not None for check in checks),
        "checks": checks,
        "paper": scenario.paper.model_dump(exclude_none=True),
        "faults": faults,
    }
    cleaned: dict[str, Any] = finite(summary)  # what --json prints is what the file holds
    return cleaned


def _marked(status: FloatArray, bit: int) -> int:
    """Return in how many rows (n,) of status bits a bit is set."""
    return int(np.count_nonzero(status.astype(np.int64) & bit))


def _summary_unit(unit: str) -> tuple[str, float]:
    """Return the unit in which a summary has an output in `unit`, and the factor to it: lengths are in um."""
    try:
        return LENGTH_UNIT, convert(1.0, unit, LENGTH_UNIT)
    except ValueError:
        return unit, 1.0


def range_of(summary: Mapping[str, Any], unit: str) -> float:
    """Return the range that the percents of a summary refer to, in the output's `unit`."""
    if "range_um" in summary:
        return convert(float(summary["range_um"]), LENGTH_UNIT, unit)
    return float(summary["range"])


def _faults(outcome: LoopOutcome) -> list[dict[str, Any]]:
    """Return all faults, the survived ones first."""
    faults: list[dict[str, Any]] = [
        {"fault": str(fault), "message": message, "step": step, "rearmed": True}
        for step, fault, message in outcome.survived
    ]
    if outcome.fault is not None:
        faults.append({"fault": str(outcome.fault), "message": outcome.message})
    return faults


def _errors(tracking: ErrorScore, sensing: ErrorScore) -> Measured:
    return {
        "tracking_mean_percent": tracking.mean_abs_percent,
        "tracking_max_percent": tracking.max_abs_percent,
        "self_sensing_mean_percent": sensing.mean_abs_percent,
        "self_sensing_max_percent": sensing.max_abs_percent,
    }


def _worst_errors(
    tracking: ErrorScore, sensing: ErrorScore, apart: Mapping[str, tuple[str, ErrorScore, ErrorScore]]
) -> Measured:
    """Return the errors that checks hold to bounds: of several outputs, the largest of each."""
    every = [_errors(*both) for _, *both in apart.values()] or [_errors(tracking, sensing)]
    return {
        name: None
        if any(one[name] is None for one in every)
        else max(float(one[name] or 0.0) for one in every)
        for name in every[0]
    }


def _levels(
    scenario: Scenario, plant: PlantSupport[Any], model: Any, signals: Mapping[str, FloatArray]
) -> tuple[list[dict[str, float]], Measured]:
    """Return one row per settled level, and the quantities of the checks; no rows without `settle_after`."""
    settle_s, period_s = scenario.checks.settle_after_s, scenario.scenario.period_s
    setpoint, output = signals["setpoint"], signals[scenario.profile.reference.name]
    if scenario.reference is None or len(setpoint) == 0:
        return [], dict.fromkeys(("hold_max_percent", "settling_max_ms", "backbone_max_hz"))
    holds = holds_of(signals["index"], setpoint, period_s, settle_s or 0.0)
    measured: Measured = {
        "hold_max_percent": hold_error_percent(setpoint, output, holds),
        "settling_max_ms": settling_ms(signals["index"], setpoint, output, period_s, holds),
        "backbone_max_hz": None,
    }
    if settle_s is None:
        return [], measured
    rows = level_rows(signals, scenario.profile, holds, lambda means: plant.predict(model, means))
    off = [abs(row["off_backbone_hz"]) for row in rows if "off_backbone_hz" in row]
    if off and np.isfinite(output).any():  # else there is no instrument, and nothing to hold it to
        measured["backbone_max_hz"] = max(off) if all(map(math.isfinite, off)) else math.inf
    return rows, measured


def _steps(scenario: Scenario, signals: Mapping[str, FloatArray], factor: float, unit: str) -> dict[str, Any]:
    """Return the figures of the steps of a reference that steps; empty where it does not, or none was measured."""
    if not isinstance(scenario.reference, Steps) or len(signals["setpoint"]) == 0:
        return {}
    period_s = scenario.scenario.period_s
    index, setpoint = signals["index"], signals["setpoint"]
    output = signals[scenario.profile.reference.name]
    holds = holds_of(index, setpoint, period_s, 0.0)
    return summarise_steps(step_responses(index, setpoint, output, period_s, holds), factor, unit)


def verdict_in_words(summary: Mapping[str, Any]) -> str:
    """Return the verdict as a person reads it: a run passes only if something was checked."""
    checked = [check for check in summary["checks"] if check["met"] is not None]
    if summary["verdict"] == "pass" and not checked:
        return "nothing was checked"
    return str(summary["verdict"])


def _checks(scenario: Scenario, measured: Measured) -> list[dict[str, Any]]:
    checks = []
    for name, limit in scenario.checks.bounds().items():
        value = measured[name]
        met = None if value is None else value <= limit
        checks.append({"check": name, "limit": limit, "measured": value, "met": met})
    return checks
