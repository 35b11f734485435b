"""Stimulus of a measured record: its inputs, its start, and the size of its motion."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rtctl.border.simulation import Stimulus
from rtctl.measured.dataset import Record
from rtctl.measured.records.jump_reading import find_after_jumps


def make_stimulus(record: Record, holds: Mapping[str, str]) -> Stimulus:
    """Return the inputs of `record` with the dataset's `holds`, and the size and start of the motion.

    It starts at rest at its first sample's displacement, unless the record says otherwise. Whether an output is read
    after an input jumps at its row is what the readings show.
    """
    measured = {name: values for name, values in record.signals.items() if name not in holds}
    rest = {name: float(measured[name][0]) for name in ("displacement",) if name in measured}
    inputs = {name: record.signals[name] for name in holds if record.has(name)}
    return Stimulus(
        inputs=inputs,
        holds=dict(holds),
        period_s=record.period_s,
        count=record.samples,
        initial=rest | dict(record.initial),
        read=frozenset(rest.keys() - record.initial.keys()),
        peak={name: float(np.abs(values).max()) for name, values in measured.items()},
        after_jumps=find_after_jumps([record], holds) if record.after_jumps is None else record.after_jumps,
        swing={name: 0.5 * float(np.ptp(values)) for name, values in measured.items()},
    )
