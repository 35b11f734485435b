"""What an answer leaves beyond the noise that was added, which is what the device's own equation would leave.

`python tests/blind/against_truth.py 3310 3382`: oscillators of the campaign by seed, a line each. Squares in units of
the noise, whitened: a fit of p numbers leaves p less than the truth does. What leaves no more than that is told from
the truth by no method, whatever was hidden.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from campaign import overrides_of
from case import diagnosed
from generator import generate
from numpy.typing import NDArray

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.residual.projection import Projected, RecordRows
from rtctl.diagnosis.residual.projection.residual_rows import account_for_quantization
from rtctl.diagnosis.residual.residual_tests import run_residual_tests

FloatArray = NDArray[np.float64]


class Left(NamedTuple):
    """Squares beyond those of the noise itself."""

    names: tuple[str, ...]
    nominal: float
    named: float
    fitted: int
    """Numbers of the named set, with two of each record's start."""
    samples: int


def left_over_truth(seed: int, **overrides: object) -> Left:
    """Of an oscillator; the named set is the nominal model where nothing is named."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truth = generate(seed, folder, plant="oscillator", **overrides)
        found = diagnosed(folder)
    data, noise = found.problem, found.search.chosen.noise[0]
    clean = {Path(record.name).stem: record.clean for record in truth.records}
    added = [
        (record.measured["displacement"] - clean[Path(record.name).stem][: record.samples])[record.first :]
        for record in data.records
    ]

    def true(index: int, error: FloatArray) -> RecordRows:
        """The device's own equation, as the gate sees a residual: what a converter rounds follows the motion."""
        nothing = np.zeros((0, 1, len(error)))
        alone = RecordRows(residual=-error[None], shared=nothing, local=nothing, directions=nothing)
        return account_for_quantization(alone, data, index, ("displacement",))

    rows = [true(index, error) for index, error in enumerate(added)]
    own = sum(float(one.gram([noise])[0][0, 0]) for one in rows)

    def projected(one: Hypothesis) -> Projected:
        return run_residual_tests(one, data, (), found.search.chosen.noise).projected

    nominal, named = projected(found.search.nominal.hypothesis), projected(found.search.chosen.hypothesis)
    return Left(
        names=tuple(cause.id for cause in found.causes), nominal=nominal.residual - own, named=named.residual - own,
        fitted=named.rank - sum(len(one.local) for one in rows), samples=sum(one.residual.shape[1] for one in rows),
    )  # fmt: skip


if __name__ == "__main__":
    for seed in map(int, sys.argv[1:]):
        of = left_over_truth(seed, **overrides_of("main", "oscillator", seed))
        print(
            f"{seed}: {', '.join(of.names) or 'nothing'} named; left beyond the noise itself, of {of.samples} samples: "
            f"nominal {of.nominal:.0f}, named {of.named:.0f} with {of.fitted} fitted numbers",
            flush=True,
        )
