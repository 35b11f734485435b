"""What a simulation is given of a measured record: its inputs, its start, and how far it went."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rtctl.border.simulation import Stimulus
from rtctl.measured.dataset import Record


def stimulus_of(record: Record, holds: Mapping[str, str]) -> Stimulus:
    """Inputs of `record` with the dataset's `holds`; its outputs only tell how large the motion was."""
    measured = {name: values for name, values in record.signals.items() if name not in holds}
    return Stimulus(
        inputs={name: record.signals[name] for name in holds if record.has(name)},
        holds=dict(holds),
        period_s=record.period_s,
        initial=dict(record.initial),
        peak={name: float(np.abs(values).max()) for name, values in measured.items()},
    )
