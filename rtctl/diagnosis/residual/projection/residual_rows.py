"""The rows of a hypothesis's records, with the error of quantized readings taken into account."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.projection.quantization import changing_samples, rounding_error_directions
from rtctl.diagnosis.residual.projection.rows import RecordRows


def residual_rows(problem: Problem, hypothesis: Hypothesis) -> list[RecordRows] | None:
    """Return the rows of each record without directions; None where the optimum is at the edge of divergence."""
    try:
        linearised = hypothesis.linearise(problem)
    except ArithmeticError:
        return None
    return [
        account_for_quantization(
            RecordRows(
                residual=record.residual, shared=record.shared, local=record.local, directions=record.shared[:0],
                period_s=problem.records[index].period_s,
            ),
            problem, index, hypothesis.sensitivity.outputs,
        )
        for index, record in enumerate(linearised)
    ]  # fmt: skip


def account_for_quantization(
    rows: RecordRows, problem: Problem, index: int, outputs: Sequence[str]
) -> RecordRows:
    """Return rows whose mean rounding error is an own parameter of the record, without samples at rest.

    A sample is at rest where the reading does not change for a period of the motion. Where a misfit is allowed the
    rows stay as they are: it is larger than the rounding.

    Args:
        rows: Rows of the record.
        problem: Problem with the readings.
        index: Index of the record.
        outputs: Names of the outputs of the rows.
    """
    steps = [0.0 if problem.allowed else problem.step(name) for name in outputs]
    if not any(steps):
        return rows
    record, thresholds, rate = problem.records[index], problem.thresholds.residual, problem.scales.rate
    turns = thresholds.rest_periods * 2.0 * np.pi
    window = round(turns / (rate * record.period_s)) if rate > 0.0 else 0
    errors, kept = [rows.local], np.zeros(rows.residual.shape[1], bool)
    for o, (name, step) in enumerate(zip(outputs, steps, strict=True)):
        readings = record.measured[name][record.first :]
        waves = rounding_error_directions(
            rows.residual[o] + readings, step, thresholds.quantization_harmonics
        )
        spread = np.zeros((len(waves), *rows.residual.shape))
        spread[:, o] = waves
        errors.append(spread)
        kept |= changing_samples(readings, step, min(window, len(readings)))
    rows = replace(rows, local=np.concatenate(errors))
    if kept.all():
        return rows
    return replace(
        rows, residual=rows.residual[:, kept], shared=rows.shared[..., kept], local=rows.local[..., kept],
        directions=rows.directions[..., kept],
    )  # fmt: skip
