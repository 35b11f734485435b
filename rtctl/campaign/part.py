"""One task: some trajectories of a campaign, from their numbers in the design to a Parquet partition."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import without_brackets
from rtctl.campaign.file import SETTINGS
from rtctl.campaign.plan import Plan
from rtctl.campaign.records import record_errors
from rtctl.orbits.classes import Orbits, Patience, classify, regular
from rtctl.orbits.forced import Drive, Lanes

STROBOSCOPIC_POINTS = 64
"""Points kept of a motion that does not settle."""


def compute_part(plan: Plan, number: int) -> bytes:
    """Return the Parquet file of part `number`: factors, then outputs, one row a trajectory; reproducible bytes."""
    first = number * plan.part
    points = plan.design.points(first, min(first + plan.part, plan.design.samples))
    outputs = record_errors(plan, points) if plan.records else _motions(plan, points)
    columns: dict[str, pa.Array] = {"trajectory": pa.array(np.arange(first, first + len(points)))}
    fields = [pa.field("trajectory", pa.int64())]
    for axis, column in zip(plan.design.axes, points.T, strict=True):
        columns[axis.name] = pa.array(column)
        fields.append(_field(axis.name, pa.float64(), axis.unit))
    for name, (found, unit) in outputs.items():
        columns[name] = found
        fields.append(_field(name, found.type, unit))
    table = pa.table(columns, schema=pa.schema(fields, metadata={"rtctl.campaign": plan.fingerprint}))
    sink = io.BytesIO()
    pq.write_table(table, sink, compression="zstd")
    return sink.getvalue()


def _motions(plan: Plan, points: FloatArray) -> dict[str, tuple[pa.Array, str]]:
    """Return outputs and their units for motions under harmonic drive."""
    forced = plan.forced()
    drive = Drive(forced, plan.steps_per_period)
    values = np.tile([one.value for one in forced.parameters], (len(points), 1))
    setting = {name: np.full(len(points), plan.fixed.get(name, 0.0)) for name in SETTINGS}
    names = [one.name for one in forced.parameters]
    for axis, column in zip(plan.design.axes, points.T, strict=True):
        if axis.name in setting:
            setting[axis.name] = column.copy()
        else:
            values[:, names.index(axis.name)] = column
    lanes = Lanes(values, setting["frequency"], setting["amplitude"])
    start = np.column_stack([setting["displacement"], setting["velocity"]])
    follow = plan.campaign.follow
    orbits = classify(drive, lanes, start, Patience(follow.look, follow.most, plan.rounded_to))
    made = {}
    for name in plan.campaign.campaign.outputs:
        make, unit = _OUTPUTS[name]
        made[name] = make(orbits, drive, lanes), without_brackets(unit.format(z=plan.units["displacement"]))
    return made


def _field(name: str, kind: pa.DataType, unit: str) -> pa.Field:
    return pa.field(name, kind, metadata={"unit": unit} if unit else None)


def _lists(parts: list[FloatArray]) -> pa.Array:
    offsets = np.concatenate(([0], np.cumsum([len(part) for part in parts]))).astype(np.int32)
    return pa.ListArray.from_arrays(offsets, pa.array(np.concatenate(parts) if parts else np.empty(0)))


def _extreme(pick: Callable[[FloatArray], np.float64]) -> Callable[[Orbits, Drive, Lanes], pa.Array]:
    return lambda orbits, drive, lanes: pa.array(
        np.array([float(pick(points)) if len(points) else np.nan for points in orbits.points])
    )


def _stroboscopic(orbits: Orbits, drive: Drive, lanes: Lanes) -> pa.Array:
    """Return the displacement at the crests of the drive, for a whole orbit or `STROBOSCOPIC_POINTS` periods."""
    found: list[FloatArray] = [np.empty(0)] * lanes.number
    for period in np.unique(orbits.period).tolist():
        if period < 0:
            continue
        chosen: NDArray[np.int64] = np.flatnonzero(orbits.period == period)
        motion = drive.march(lanes.of(chosen), orbits.state[chosen], period or STROBOSCOPIC_POINTS)
        for lane, points in zip(chosen.tolist(), motion.displacement[1:].T, strict=True):
            found[lane] = points
    return _lists(found)


def _attractor(orbits: Orbits, drive: Drive, lanes: Lanes) -> pa.Array:
    """Describe the orbit by kind, period and range: equal words mean the same orbit, wherever the motion started."""
    found = []
    for kind, period, points in zip(orbits.kind, orbits.period.tolist(), orbits.points, strict=True):
        if period > 0 and len(points):
            found.append(f"{regular(points)} P{period} {points.min():+.1f} to {points.max():+.1f}")
        else:
            found.append(str(kind))
    return pa.array(found)


_OUTPUTS: Mapping[str, tuple[Callable[[Orbits, Drive, Lanes], pa.Array], str]] = {
    "kind": (lambda orbits, drive, lanes: pa.array([str(one) for one in orbits.kind]), ""),
    "kind_by_rule": (lambda orbits, drive, lanes: pa.array([str(one) for one in orbits.by_rule]), ""),
    "attractor": (_attractor, ""),
    "period": (lambda orbits, drive, lanes: pa.array(orbits.period), ""),
    "settled_s": (lambda orbits, drive, lanes: pa.array(orbits.settled_s), "s"),
    "exponent": (lambda orbits, drive, lanes: pa.array(orbits.exponent), "1/s"),
    "lowest": (_extreme(np.min), "{z}"),
    "highest": (_extreme(np.max), "{z}"),
    "end_displacement": (lambda orbits, drive, lanes: pa.array(orbits.state[:, 0].copy()), "{z}"),
    "end_velocity": (lambda orbits, drive, lanes: pa.array(orbits.state[:, 1].copy()), "({z})/s"),
    "turning_points": (lambda orbits, drive, lanes: _lists(orbits.points), "{z}"),
    "stroboscopic": (_stroboscopic, "{z}"),
}
