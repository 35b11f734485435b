"""A measured record in the form that the fits take: its inputs, its outputs and the first scored sample."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.motion import DERIVATIVES
from rtctl.border.simulation import Stimulus
from rtctl.measured.dataset import Dataset, Record
from rtctl.measured.stimulus import make_stimulus

CONTINUATION_SAMPLES = 128
"""Input samples that a truncated record keeps beyond its end: a band-limited input depends on them before it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FitRecord:
    """A record to fit; all arrays (n,) in the dataset's units."""

    name: str
    stimulus: Stimulus
    measured: Mapping[str, FloatArray]
    """Measured outputs by name."""
    first: int = 0
    """First scored sample; the samples before it only prepare the state."""
    repeat: str | None = None
    """Letter of a group of repeated records: all of a group had the same input."""
    begin: int = 0
    """Where it was cut from a longer record of the same name: the sample of that record at which it begins."""

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.stimulus.samples

    @property
    def period_s(self) -> float:
        """Sample period [s]."""
        return self.stimulus.period_s

    def truncate(self, samples: int) -> FitRecord:
        """Return the first `samples` samples as a record with the same start."""
        whole = self.stimulus
        inputs = {name: values[:samples] for name, values in whole.inputs.items()}
        onward = {
            name: np.concatenate((values[samples:], whole.onward.get(name, np.empty(0))))[
                :CONTINUATION_SAMPLES
            ]
            for name, values in whole.inputs.items()
        }
        stimulus = replace(whole, inputs=inputs, onward=onward, count=min(samples, whole.samples))
        measured = {name: values[:samples] for name, values in self.measured.items()}
        return replace(self, stimulus=stimulus, measured=measured)

    def cut(self, begin: int, end: int) -> FitRecord:
        """Return samples `begin` to `end` as a record with an unknown start, all of whose samples are scored."""
        whole = self.stimulus
        return FitRecord(
            name=self.name,
            stimulus=Stimulus(
                inputs={name: values[begin:end] for name, values in whole.inputs.items()},
                holds=whole.holds,
                period_s=whole.period_s,
                count=end - begin,
                peak=whole.peak,
                swing=whole.swing,
                after_jumps=whole.after_jumps,
            ),
            measured={name: values[begin:end] for name, values in self.measured.items()},
            begin=self.begin + begin,
        )


def make_fit_record(record: Record, holds: Mapping[str, str]) -> FitRecord:
    """Convert `record` of a dataset whose inputs are the keys of `holds` (how each input is held between samples)."""
    return FitRecord(
        name=record.name,
        stimulus=make_stimulus(record, holds),
        measured={name: values for name, values in record.signals.items() if name not in holds},
        first=record.ignore_first,
        repeat=record.repeat,
    )


def select_fit_records(dataset: Dataset, uses: Iterable[str] = ("fit", "identify")) -> tuple[FitRecord, ...]:
    """Return the records whose use is one of `uses`, in the dataset's order; never the test records."""
    wanted = set(uses) - {"test"}
    return tuple(make_fit_record(record, dataset.holds) for record in dataset.records if record.use in wanted)


def response_of(records: Iterable[FitRecord]) -> str:
    """Return the lowest derivative of the motion that all records have; "displacement" where there is none."""
    named = [set(record.measured) for record in records]
    return next((name for name in DERIVATIVES if all(name in one for one in named)), "displacement")


def derivative_order(output: str) -> int:
    """Return how many time derivatives of the displacement an output is; 0 for any other reading."""
    return DERIVATIVES.get(output, 0)
