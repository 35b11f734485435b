"""What a run amounts to: verdict, scores, checks, timing, faults; the content of `summary.json`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtctl.border.quantities import convert
from rtctl.border.records import DeviceStatus
from rtctl.loop import LoopOutcome
from rtctl.metrics import NOT_SCORED, finite, score, timing_summary
from rtctl.plants.support import PlantSupport
from rtctl.scenario import Scenario

FloatArray = NDArray[np.float64]


def summarise(
    scenario: Scenario,
    plant: PlantSupport[Any],
    model: Any,
    outcome: LoopOutcome,
    signals: Mapping[str, FloatArray],
    timing: Mapping[str, FloatArray],
) -> dict[str, Any]:
    """The run summary of the file formats, with percentages of the model's output range beside."""
    output = scenario.profile.reference
    to_um = convert(1.0, output.unit, "um")
    span = to_um * plant.output_range(scenario, model).width
    measured = to_um * signals[output.name]
    sensing = score(to_um * signals["estimate"], measured, span)
    tracking = (
        NOT_SCORED if scenario.reference is None else score(to_um * signals["setpoint"], measured, span)
    )
    faults = [] if outcome.fault is None else [{"fault": str(outcome.fault), "message": outcome.message}]
    checks = _checks(scenario, tracking, sensing)
    failed = [
        check for check in checks if check["met"] is False
    ]  # None: no instrument, nothing to hold it to
    summary: dict[str, Any] = {
        "scenario": scenario.scenario.title,
        "verdict": "fault" if faults else "fail" if failed else "pass",
        "tracking": tracking._asdict(),
        "self_sensing": sensing._asdict(),
        "range_um": span,
        "estimator": scenario.estimator.kind,
        "driver": scenario.driver.kind,
        "clock": scenario.clock.mode,
        "device": plant.identity(model),
        "timing": timing_summary(timing, scenario.scenario.period_s, outcome.steps, outcome.overruns),
        "clamped_steps": int(
            np.count_nonzero(signals["device_status"].astype(np.int64) & DeviceStatus.CLAMPED)
        ),
        "checked": all(check["met"] is not None for check in checks),
        "checks": checks,
        "paper": scenario.paper.model_dump(exclude_none=True),
        "faults": faults,
    }
    cleaned: dict[str, Any] = finite(summary)  # what --json prints is what the file holds
    return cleaned


def _checks(scenario: Scenario, tracking: Any, sensing: Any) -> list[dict[str, Any]]:
    measured = {
        "tracking_mean_percent": tracking.mean_abs_percent,
        "tracking_max_percent": tracking.max_abs_percent,
        "self_sensing_mean_percent": sensing.mean_abs_percent,
        "self_sensing_max_percent": sensing.max_abs_percent,
    }
    limits = scenario.checks.model_dump(exclude_none=True)
    return [
        {"check": name, "limit": limit, "measured": measured[name],
         "met": None if measured[name] is None else measured[name] <= limit}
        for name, limit in limits.items()
    ]  # fmt: skip
