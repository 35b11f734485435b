"""A model's error on measured records, one row per set of parameters: free-run simulation without measured outputs."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from rtctl.border.arrays import FloatArray
from rtctl.campaign.plan import Plan
from rtctl.wiring_models import build_simulation

LANES = 32
"""Sets simulated together."""


def record_errors(plan: Plan, points: FloatArray) -> dict[str, tuple[pa.Array, str]]:
    """Return columns and their units: RMS over all records' scored samples, absolute and relative to the signals' RMS.

    A column name ends with the measured output's name where there are several. Infinite where the run diverged.
    """
    simulation = build_simulation(plan.model, plan.units, plan.campaign.campaign.model)
    names = [one.name for one in simulation.parameters]
    values = np.tile([one.value for one in simulation.parameters], (len(points), 1))
    for axis, column in zip(plan.design.axes, points.T, strict=True):
        values[:, names.index(axis.name)] = column
    outputs = [name for name in simulation.outputs if any(name in one.measured for one in plan.records)]
    squared = {name: np.zeros(len(points)) for name in outputs}
    power, count = dict.fromkeys(outputs, 0.0), dict.fromkeys(outputs, 0)
    for record in plan.records:
        for first in range(0, len(points), LANES):
            part = slice(first, first + LANES)
            found = simulation.predict(record.stimulus, values[part])
            for name in outputs:
                if name in record.measured:
                    error = found.outputs[name][:, record.first :] - record.measured[name][record.first :]
                    squared[name][part] += np.nan_to_num(np.sum(error**2, axis=1), nan=np.inf)
        for name in outputs:
            if name in record.measured:
                power[name] += float(np.sum(record.measured[name][record.first :] ** 2))
                count[name] += record.samples - record.first
    made = {}
    for asked in plan.campaign.campaign.outputs:
        for name in outputs:
            label = asked if len(outputs) == 1 else f"{asked}_{name}"
            if asked == "rms_error":
                made[label] = pa.array(np.sqrt(squared[name] / max(count[name], 1))), plan.units[name]
            else:
                with np.errstate(divide="ignore", invalid="ignore"):
                    made[label] = pa.array(np.sqrt(squared[name] / power[name])), ""
    return made
