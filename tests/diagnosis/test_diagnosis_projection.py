"""What is left beyond a hypothesis' own unknowns comes from one Gram matrix, with unknowns of a record or none."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.diagnosis.projection import Rows, by_output, leftover, noise_of, project


@pytest.mark.parametrize("own", [0, 2])
def test_the_gram_matrix_leaves_what_least_squares_leaves(own: int) -> None:
    draw = np.random.default_rng(1)
    rows = [
        Rows(
            residual=draw.standard_normal((2, n)), shared=draw.standard_normal((3, 2, n)),
            own=draw.standard_normal((own, 2, n)), directions=draw.standard_normal((4, 2, n)),
        )
        for n in (300, 200)
    ]  # fmt: skip
    noise = noise_of(rows)
    projected = project(rows, noise)
    table = np.concatenate([row.whitened(noise)[0] for row in rows], axis=1)
    weights = np.linalg.lstsq(table[1:4].T, table[0], rcond=None)[0]
    left = table[0] - weights @ table[1:4]
    assert projected.residual == pytest.approx(left @ left, rel=1e-9)
    assert (projected.samples, projected.rank) == (1000, 3 + 2 * own)
    assert [one.shape for one in leftover(rows, noise)] == [(2, 300), (2, 200)]


def test_a_direction_is_shared_out_by_what_is_left_of_it_in_each_output() -> None:
    draw = np.random.default_rng(2)
    directions = draw.standard_normal((3, 2, 400))
    directions[0, 1] = 0.0  # the first output's alone
    row = Rows(
        residual=draw.standard_normal((2, 400)), shared=draw.standard_normal((3, 2, 400)),
        own=draw.standard_normal((2, 2, 400)), directions=directions,
    )  # fmt: skip
    noise = noise_of([row])
    table = row.whitened(noise)[0]
    basis = np.linalg.qr(table[1:4].T)[0]
    left = (table[4:] - (table[4:] @ basis) @ basis.T).reshape(3, 2, 400)
    squares = np.sum(left**2, axis=2).T
    found = by_output(project([row], noise), [row], noise)
    assert found == pytest.approx(squares / squares.sum(axis=0), abs=1e-12)
    assert found[0, 0] > 0.95
