"""Whether rows of an output are read just after a held input jumps at them, or just before.

A converter that writes its output and then reads its input, and most simulations, give what follows the jump: y(k) has
the u of row k. Read before it, y(k) has that of row k - 1. Where an output takes its input at once, as an acceleration
or the current of a resistor do, the difference is a few percent of it where the input is finely sampled, and all of it
where that is noise. A linear predictor of row k,

    y(k) = sum_{i=1..n} c_i y(k-i) + sum_{i=0..n} b_i u(k-i) + c

tells them apart: of a step of u its answer in the first row is b_0, in the second b_0 (1 + c_1) + b_1. After the jump
both are near to what y takes of u at once; before it the first is none. What an input leaks into a reading is less than
half of that. An output that takes no input at once has no answer in the first row.

Reference: L. Ljung, System Identification, 1999, section 4.2 (ARX models).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.measured.dataset import Record

ORDER = 4
"""Rows of the past; a resonance alone has two, the others take up what a noise and a further law do to a predictor."""
MOST_ROWS = 20_000
"""Rows that are looked at: more know it no better."""
LEAST_SIGNIFICANCE = 5.0
"""Standard errors of b_0 from which it is there."""
NEVER_AT_ONCE = frozenset({"displacement", "velocity", "resistance", "deflection"})
"""Outputs of an oscillator and a vo2 that take no input at once."""
LEAST_SHARE = 0.5
"""Least part of the answer's second row that its first has, after a jump."""


class Answer(NamedTuple):
    """What rows of an output have of a step of an input."""

    first: float
    """In the row in which the input steps: b_0."""
    second: float
    """In the row after it."""
    error: float
    """Standard error of `first`."""


class JumpEvidence:
    """What records that one instrument read show, one after the other; the more one tells, the more it counts."""

    def __init__(self, holds: Iterable[str]) -> None:
        """Begin; `holds`: names of the inputs."""
        self._inputs = tuple(holds)
        self._answers: dict[str, list[list[Answer]]] = {}

    def see(self, record: Record) -> None:
        """Take in a record."""
        if record.is_sweep or not self._inputs or not all(record.has(name) for name in self._inputs):
            return
        inputs = [record.signals[name] for name in self._inputs]
        for name, output in record.signals.items():
            if name in self._inputs or name in NEVER_AT_ONCE:
                continue
            if answers := answers_to_steps(inputs, output):
                self._answers.setdefault(name, []).append(answers)

    @property
    def after_jumps(self) -> frozenset[str]:
        """Outputs whose rows already have an input of their own row."""
        return frozenset(
            name
            for name, of_records in self._answers.items()
            if any(_is_at_once(of_input) for of_input in zip(*of_records, strict=True))
        )


def find_after_jumps(records: Iterable[Record], holds: Iterable[str]) -> frozenset[str]:
    """Return the outputs of records that are read just after an input jumps; `holds`: names of the inputs."""
    evidence = JumpEvidence(holds)
    for record in records:
        evidence.see(record)
    return evidence.after_jumps


def _is_at_once(answers: Sequence[Answer]) -> bool:
    """Return whether the answer to an input, of all records together, is there in the first row."""
    first, second, error = np.array(answers).T
    weight = 1.0 / np.maximum(error, 1e-9 * np.abs(second) + 1e-300) ** 2
    if not np.sum(weight) > 0.0:
        return False
    mean, after = (float(np.sum(weight * one) / np.sum(weight)) for one in (first, second))
    return abs(mean) > LEAST_SIGNIFICANCE / math.sqrt(np.sum(weight)) and abs(mean) > LEAST_SHARE * abs(after)


def answers_to_steps(inputs: Sequence[FloatArray], output: FloatArray) -> list[Answer]:
    """Return what rows have of a step of each input; empty where a record cannot tell."""
    y, driven = output[:MOST_ROWS], [one[:MOST_ROWS] for one in inputs]
    rows, columns = len(y) - ORDER, (1 + len(driven)) * (ORDER + 1)
    finite = all(np.isfinite(one).all() for one in (y, *driven))
    moving = [bool(np.ptp(one) > 0.0) for one in driven]
    if rows < 4 * columns or not finite or not np.ptp(y) > 0.0 or not any(moving):
        return []
    past = [y[ORDER - i : len(y) - i] for i in range(1, ORDER + 1)]
    lagged = [one[ORDER - i : len(y) - i] for one in driven for i in range(ORDER + 1)]
    table = np.column_stack([*past, *lagged, np.ones(rows)])
    sizes = np.sqrt(np.mean(table**2, axis=0))
    sizes[sizes == 0.0] = 1.0
    vectors, values, weights = np.linalg.svd(table / sizes, full_matrices=False)
    inverse = np.where(values > 1e-12 * values[0], 1.0 / np.maximum(values, 1e-300), 0.0)
    found = weights.T @ (inverse * (vectors.T @ y[ORDER:]))
    left = y[ORDER:] - (table / sizes) @ found
    errors = (
        np.sqrt(float(left @ left) / (rows - columns) * np.sum((weights.T * inverse) ** 2, axis=1)) / sizes
    )
    coefficients = found / sizes
    answers = []
    for at, moves in zip(range(ORDER, len(sizes) - 1, ORDER + 1), moving, strict=True):
        if not moves:
            answers.append(Answer(0.0, 0.0, math.inf))
            continue
        first = float(coefficients[at])
        second = first * (1.0 + float(coefficients[0])) + float(coefficients[at + 1])
        answers.append(Answer(first, second, float(errors[at])))
    return answers
