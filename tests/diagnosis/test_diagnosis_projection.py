"""What is left beyond a hypothesis' own unknowns comes from one Gram matrix, with unknowns of a record or none."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.signal import lfilter

from rtctl.diagnosis.residual.projection import (
    RecordRows,
    estimate_noise,
    project,
    share_by_output,
    unexplained_residual,
)
from rtctl.diagnosis.thresholds import ResidualThresholds
from rtctl.identification.noise.residual_noise import NoiseModel, fit_autoregression, limit_order
from rtctl.identification.noise.resonant_part import Resonance
from rtctl.identification.threads import open_thread_pool


@pytest.mark.parametrize("own", [0, 2])
def test_the_gram_matrix_leaves_what_least_squares_leaves(own: int) -> None:
    draw = np.random.default_rng(1)
    rows = [
        RecordRows(
            residual=draw.standard_normal((2, n)), shared=draw.standard_normal((3, 2, n)),
            local=draw.standard_normal((own, 2, n)), directions=draw.standard_normal((4, 2, n)),
        )
        for n in (300, 200)
    ]  # fmt: skip
    noise = estimate_noise(rows)
    projected = project(rows, noise)
    table = np.concatenate([row.whitened(noise)[0] for row in rows], axis=1)
    weights = np.linalg.lstsq(table[1:4].T, table[0], rcond=None)[0]
    left = table[0] - weights @ table[1:4]
    assert projected.residual == pytest.approx(left @ left, rel=1e-9)
    assert (projected.samples, projected.rank) == (1000, 3 + 2 * own)
    assert [one.shape for one in unexplained_residual(rows, noise)] == [(2, 300), (2, 200)]


def test_a_direction_is_shared_out_by_what_is_left_of_it_in_each_output() -> None:
    draw = np.random.default_rng(2)
    directions = draw.standard_normal((3, 2, 400))
    directions[0, 1] = 0.0  # the first output's alone
    row = RecordRows(
        residual=draw.standard_normal((2, 400)), shared=draw.standard_normal((3, 2, 400)),
        local=draw.standard_normal((2, 2, 400)), directions=directions,
    )  # fmt: skip
    noise = estimate_noise([row])
    table = row.whitened(noise)[0]
    basis = np.linalg.qr(table[1:4].T)[0]
    left = (table[4:] - (table[4:] @ basis) @ basis.T).reshape(3, 2, 400)
    squares = np.sum(left**2, axis=2).T
    found = share_by_output(project([row], noise), [row], noise)
    assert found == pytest.approx(squares / squares.sum(axis=0), abs=1e-12)
    assert found[0, 0] > 0.95


def test_what_a_start_follows_of_a_direction_is_told_apart_from_what_moves_nothing() -> None:
    draw = np.random.default_rng(4)
    local, directions = draw.standard_normal((2, 1, 300)), draw.standard_normal((3, 1, 300))
    directions[0], directions[1] = 2.0 * local[0] - local[1], 0.0
    row = RecordRows(
        residual=draw.standard_normal((1, 300)), shared=draw.standard_normal((2, 1, 300)),
        local=local, directions=directions,
    )  # fmt: skip
    projected = project([row], [NoiseModel(np.empty(0), 1.0)])
    flat, basis = directions[2, 0], np.linalg.qr(local[:, 0].T)[0]
    left = flat - basis @ (basis.T @ flat)
    assert projected.beyond_own[0] == 0.0
    assert np.isnan(projected.beyond_own[1])
    assert projected.beyond_own[2] == pytest.approx(left @ left / (flat @ flat))


def test_restricted_likelihood_adds_what_all_unknowns_took_of_the_noise() -> None:
    draw = np.random.default_rng(3)
    rows = [
        RecordRows(
            residual=lfilter([1.0], [1.0, -0.8], draw.standard_normal((1, n))),
            shared=draw.standard_normal((2, 1, n)), local=draw.standard_normal((2, 1, n)),
            directions=draw.standard_normal((5, 1, n)),
        )
        for n in (120, 90)
    ]  # fmt: skip
    lengths = [120, 90]
    shared = np.concatenate([np.concatenate((row.shared, row.directions))[:, 0] for row in rows], axis=1)
    design = np.vstack((block_diag(*(row.local[:, 0] for row in rows)), shared)).T
    residual = np.concatenate([row.residual[0] for row in rows])
    noise = NoiseModel(np.empty(0), 1.0)
    for turn in range(ResidualThresholds().noise_iterations):
        whitening = block_diag(*(noise.whiten(np.eye(n)).T for n in lengths))
        white = whitening @ design
        covariance = np.linalg.inv(white.T @ white)
        left = residual - design @ covariance @ white.T @ whitening @ residual
        products = np.outer(left, left) + (design @ covariance @ design.T if turn else 0.0)
        highest = limit_order(lengths)
        blocks = (products[:120, :120], products[120:, 120:])
        correlation = [sum(np.trace(block, lag) for block in blocks) for lag in range(highest + 1)]
        noise = fit_autoregression(np.array(correlation), sum(lengths))
    found = estimate_noise(rows)[0]
    assert found.coefficients == pytest.approx(noise.coefficients, abs=1e-9)
    assert found.variance == pytest.approx(noise.variance, rel=1e-9)


@pytest.mark.parametrize("round_off", [0.0, 1e-9])
def test_what_a_records_own_unknowns_follow_is_no_direction_and_leaves_the_noise_as_it_is(
    round_off: float,
) -> None:
    """A sensor's offset, of a mass that nothing holds: its start follows it."""
    draw = np.random.default_rng(4)
    own = draw.standard_normal((2, 1, 400))
    rows = RecordRows(
        residual=draw.standard_normal((1, 400)), shared=draw.standard_normal((2, 1, 400)), local=own,
        directions=np.concatenate(
            (own[:1] + round_off * draw.standard_normal((1, 1, 400)), draw.standard_normal((2, 1, 400)))
        ),
    )  # fmt: skip
    noise = estimate_noise([rows], slow=True)
    assert noise[0].mean_square == pytest.approx(1.0, rel=0.3)
    projected = project([rows], noise)
    assert projected.usable.tolist() == [False, True, True]
    assert projected.single()[0] == 0.0


def in_a_band(draw: np.random.Generator, noise: np.ndarray, directions: int, highest: float) -> RecordRows:
    """A record whose directions are sines and cosines below a frequency [periods per sample], nearly all of them."""
    samples = len(noise)
    phases = 2.0 * np.pi * np.outer(np.linspace(0.5 / samples, highest, directions // 2), np.arange(samples))
    lines = np.concatenate([np.sin(phases), np.cos(phases)])[:, None]
    return RecordRows(
        residual=noise[None], shared=lines[::40] + 0.1 * draw.standard_normal(lines[::40].shape),
        local=np.exp(-0.02 * np.arange(samples))[None, None], directions=lines,
    )  # fmt: skip


@pytest.mark.parametrize("directions", [60, 180])
def test_directions_that_fill_a_band_leave_the_noise_its_size(directions: int) -> None:
    """The hole that they leave became the noise's colour, and a chi-squared of 140 expected came as 400."""
    ratios = []
    for seed in range(8):
        draw = np.random.default_rng(seed)
        row = in_a_band(draw, draw.standard_normal(600), directions, 0.15)
        noise = estimate_noise([row], slow=True)
        assert noise[0].mean_square == pytest.approx(1.0, rel=0.25)
        projected = project([row], noise)
        statistic, rank = projected.block(np.arange(directions))
        ratios.append(statistic / rank)
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.12)


def test_noise_with_a_colour_keeps_it_under_directions_that_fill_a_band() -> None:
    draw = np.random.default_rng(3)
    coloured = lfilter([1.0], [1.0, -0.6], draw.standard_normal(1600))[400:]
    row = in_a_band(draw, coloured, 180, 0.05)
    noise = estimate_noise([row], slow=True)[0]
    assert noise.mean_square == pytest.approx(1.0 / (1.0 - 0.36), rel=0.25)
    assert noise.coefficients[0] == pytest.approx(-0.6, abs=0.12)


def test_threads_take_the_records_and_find_the_same_noise() -> None:
    """Records of two lengths, a peak of the device's resonance in the noise, and a slow part to look for."""
    draw = np.random.default_rng(6)
    rows = [
        RecordRows(
            residual=lfilter([1.0], [1.0, -1.8, 0.98], draw.standard_normal((1, n)))
            + 3.0 * draw.standard_normal((1, n)),
            shared=draw.standard_normal((2, 1, n)), local=draw.standard_normal((1, 1, n)),
            directions=draw.standard_normal((20, 1, n)), period_s=1e-3,
        )
        for n in (900, 600, 900)
    ]  # fmt: skip
    peak = Resonance(math.acos(0.9 / math.sqrt(0.98)) / (2.0 * math.pi * 1e-3), 0.02)
    alone = estimate_noise(rows, resonances=(peak,), slow=True)[0]
    with open_thread_pool(3) as executor:
        found = estimate_noise(rows, resonances=(peak,), slow=True, executor=executor)[0]
    assert alone.resonant
    assert np.array_equal(found.power(512), alone.power(512))
