"""A measured record as the fits take it: what drove it, what was read, from where on it counts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus
from rtctl.measured.dataset import Dataset, Record
from rtctl.measured.stimulus import make_stimulus

CONTINUATION_SAMPLES = 128
"""Samples of an input that a beginning knows beyond its end: a band-limited one depends on them before."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FitRecord:
    """One record; all arrays (n,) in the dataset's units."""

    name: str
    stimulus: Stimulus
    measured: Mapping[str, FloatArray]
    """Outputs."""
    first: int = 0
    """Samples before it start the state and are not scored."""
    repeat: str | None = None
    """Records of the same letter had the same input."""

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.stimulus.samples

    @property
    def period_s(self) -> float:
        """Between samples."""
        return self.stimulus.period_s

    def truncate(self, samples: int) -> FitRecord:
        """The first samples, from the same start."""
        whole = self.stimulus
        inputs = {name: values[:samples] for name, values in whole.inputs.items()}
        onward = {
            name: np.concatenate((values[samples:], whole.onward.get(name, np.empty(0))))[
                :CONTINUATION_SAMPLES
            ]
            for name, values in whole.inputs.items()
        }
        stimulus = replace(whole, inputs=inputs, onward=onward)
        measured = {name: values[:samples] for name, values in self.measured.items()}
        return replace(self, stimulus=stimulus, measured=measured)

    def cut(self, begin: int, end: int) -> FitRecord:
        """Samples `begin` to `end` as a record that starts anywhere: its start is not known, all of it is scored."""
        whole = self.stimulus
        return FitRecord(
            name=self.name,
            stimulus=Stimulus(
                inputs={name: values[begin:end] for name, values in whole.inputs.items()},
                holds=whole.holds,
                period_s=whole.period_s,
                peak=whole.peak,
                swing=whole.swing,
            ),
            measured={name: values[begin:end] for name, values in self.measured.items()},
        )


def make_fit_record(record: Record, holds: Mapping[str, str]) -> FitRecord:
    """`record` of a dataset with these `holds`."""
    return FitRecord(
        name=record.name,
        stimulus=make_stimulus(record, holds),
        measured={name: values for name, values in record.signals.items() if name not in holds},
        first=record.ignore_first,
        repeat=record.repeat,
    )


def select_fit_records(dataset: Dataset, uses: Iterable[str] = ("fit", "identify")) -> tuple[FitRecord, ...]:
    """Those that a fit may see, in order; never the test records."""
    wanted = set(uses) - {"test"}
    return tuple(make_fit_record(record, dataset.holds) for record in dataset.records if record.use in wanted)
