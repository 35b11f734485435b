"""A hypothesis' residual and slopes as rows of the projection, less what a converter's steps make of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.projection import Rows
from rtctl.diagnosis.residual.quantization import heard, rounding_errors


def own_rows(problem: Problem, hypothesis: Hypothesis) -> list[Rows] | None:
    """Without directions; None where the optimum is on the edge of divergence."""
    try:
        lines = hypothesis.linearise(problem)
    except ArithmeticError:
        return None
    return [
        as_converted(
            Rows(
                residual=line.residual, shared=line.shared, local=line.local, directions=line.shared[:0],
                period_s=problem.records[index].period_s,
            ),
            problem, index, hypothesis.sensitivity.outputs,
        )
        for index, line in enumerate(lines)
    ]  # fmt: skip


def as_converted(rows: Rows, problem: Problem, index: int, outputs: Sequence[str]) -> Rows:
    """`rows` of record `index` where readings have a converter's steps: their mean error is an unknown of the record,
    and samples at which the reading rests for a period are left out. Not where a misfit is allowed: it is larger.
    """
    steps = [0.0 if problem.allowed else problem.step(name) for name in outputs]
    if not any(steps):
        return rows
    record = problem.records[index]
    window = round(2.0 * np.pi / (problem.scales.rate * record.period_s)) if problem.scales.rate > 0.0 else 0
    errors, kept = [rows.local], np.zeros(rows.residual.shape[1], bool)
    for o, (name, step) in enumerate(zip(outputs, steps, strict=True)):
        readings = record.measured[name][record.first :]
        found = rounding_errors(rows.residual[o] + readings, step)
        spread = np.zeros((len(found), *rows.residual.shape))
        spread[:, o] = found
        errors.append(spread)
        kept |= heard(readings, step, min(window, len(readings)))
    rows = replace(rows, local=np.concatenate(errors))
    if kept.all():
        return rows
    return replace(
        rows, residual=rows.residual[:, kept], shared=rows.shared[..., kept], local=rows.local[..., kept],
        directions=rows.directions[..., kept],
    )  # fmt: skip
