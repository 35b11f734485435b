"""Steps follow a valley that is bent, and know how it bends."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from oscillator_cases import DUFFING, multisine, oscillator, record_of

from rtctl.identification.fit_record import FitRecord
from rtctl.identification.least_squares.arrowhead_solver import NormalEquations, make_zero_equations
from rtctl.identification.least_squares.levenberg_marquardt import (
    Minimum,
    SecondDerivative,
    Status,
    Unknowns,
    minimise,
)
from rtctl.identification.simulation_error.segments import PRIOR_WEIGHT, Segment, SegmentCost
from rtctl.identification.simulation_error.sensitivity import Linearisation, Sensitivity

FloatArray = NDArray[np.float64]
NARROW = 100.0
"""Times as steep across the valley y = x^2 as along it; its minimum is at (1, 1)."""
UNBOUNDED = (np.full(2, -np.inf), np.full(2, np.inf))
NOTHING = np.empty((0, 0))
MOST = 400


def valley(at: Unknowns) -> NormalEquations:
    x, y = at.shared
    slopes = np.array([[-2.0 * NARROW * x, NARROW], [-1.0, 0.0]])
    residual = np.array([NARROW * (y - x**2), 1.0 - x])
    found = make_zero_equations(2, 0, 0)
    found.shared[...] = slopes.T @ slopes
    found.shared_gradient[...] = slopes.T @ residual
    return found._replace(cost=0.5 * float(residual @ residual))


def its_bend(at: Unknowns, move: Unknowns) -> Unknowns:
    slopes = np.array([[-2.0 * NARROW * at.shared[0], NARROW], [-1.0, 0.0]])
    return Unknowns(slopes.T @ np.array([-2.0 * NARROW * move.shared[0] ** 2, 0.0]), NOTHING)


def steps_taken(bend: SecondDerivative | None) -> tuple[Minimum, int]:
    """From the far side of the valley, and how many points were asked for."""
    asked = []

    def counted(at: Unknowns) -> NormalEquations:
        asked.append(at)
        return valley(at)

    start, ways = (
        Unknowns(np.array([-3.0, 9.0]), NOTHING),
        {} if bend is None else {"second_derivative": bend},
    )
    found = minimise(counted, start, *UNBOUNDED, iterations=MOST, tolerance=1e-12, **ways)
    assert found is not None
    return found, len(asked)


def test_a_valley_is_followed_around_its_bend() -> None:
    straight, along = steps_taken(None), steps_taken(its_bend)
    assert along[0].status is Status.CONVERGED
    assert along[0].unknowns.shared == pytest.approx([1.0, 1.0], abs=1e-6)
    assert along[1] < straight[1] / 3


def test_steps_that_keep_what_they_promise_are_not_asked_for_a_bend() -> None:
    asked = []

    def line(at: Unknowns) -> NormalEquations:
        found = make_zero_equations(2, 0, 0)
        found.shared[...] = np.diag([1.0, 4.0])
        found.shared_gradient[...] = np.array([1.0, 4.0]) * (at.shared - 1.0)
        return found._replace(cost=0.5 * float(np.array([1.0, 4.0]) @ (at.shared - 1.0) ** 2))

    def bend(at: Unknowns, move: Unknowns) -> None:
        asked.append(at)

    found = minimise(
        line, Unknowns(np.array([5.0, -7.0]), NOTHING), *UNBOUNDED, iterations=50, second_derivative=bend
    )
    assert found is not None
    assert found.unknowns.shared == pytest.approx([1.0, 1.0], abs=1e-4)
    assert asked == []


@pytest.fixture(scope="module")
def cost() -> SegmentCost:
    """Two records of a Duffing oscillator in units of its noise."""
    simulation = oscillator(DUFFING)
    records = [
        record_of(simulation, multisine(5.0, 30.0, 2.0, 400.0, 3.0, seed), 400.0, 0.01, seed)
        for seed in (1, 2)
    ]
    return SegmentCost(
        sensitivity=Sensitivity.of(simulation, records),
        segments=[Segment(record, np.zeros(2), False) for record in records],
        sigma=np.array([0.01]),
    )  # fmt: skip


def residuals(cost: SegmentCost, at: Unknowns) -> list[FloatArray]:
    found = [cost.linearise(k, at) for k in range(len(cost.segments))]
    return [one.residual / cost.sigma[:, None] for one in found if one is not None]


def test_the_bend_is_the_residuals_second_derivative_on_the_slopes(cost: SegmentCost) -> None:
    start = cost.sensitivity.current_values / cost.sensitivity.scale
    draw = np.random.default_rng(0)
    here, by = (
        cost.start(1.01 * start),
        Unknowns(1e-3 * start * draw.standard_normal(4), 0.01 * draw.random((2, 2))),
    )
    found = cost.compute_second_derivative(here, by)
    assert found is not None
    small = 0.03
    at = [
        Unknowns(here.shared + k * small * by.shared, here.local + k * small * by.local) for k in (-1, 0, 1)
    ]
    before, now, after = (residuals(cost, one) for one in at)
    second = [(b - 2.0 * n + a) / small**2 for b, n, a in zip(before, now, after, strict=True)]
    lines = [cost.linearise(k, here) for k in range(2)]
    shared = sum(
        np.tensordot(line.shared / cost.sigma[:, None], one, 2)
        for line, one in zip(lines, second, strict=True)
        if line is not None
    )
    assert found.shared == pytest.approx(shared, rel=0.05)
    for k, line in enumerate(lines):
        assert line is not None
        assert found.local[k] == pytest.approx(
            np.tensordot(line.local / cost.sigma[:, None], second[k], 2), rel=0.05
        )


def test_derivatives_are_kept_while_steps_from_there_are_rejected(
    cost: SegmentCost, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = cost.start(1.01 * cost.sensitivity.current_values / cost.sensitivity.scale)
    by = Unknowns(1e-3 * here.shared, here.local)
    expected, keeping = cost.compute_second_derivative(here, by), cost.with_changes(cache_size=2)
    assert expected is not None
    points, linearise = [], Sensitivity.linearise

    def counted(self: Sensitivity, record: FitRecord, shared: FloatArray, *rest: Any) -> Linearisation | None:
        points.append(shared)
        return linearise(self, record, shared, *rest)

    monkeypatch.setattr(Sensitivity, "linearise", counted)
    keeping.equations(here)
    for rejected in (1, 2, 3):
        found = keeping.compute_second_derivative(here, by)
        assert found is not None
        assert found.shared == pytest.approx(expected.shared, rel=1e-12)
        keeping.equations(Unknowns(here.shared + rejected * by.shared, here.local))
    assert sum(point is here.shared for point in points) == len(cost.segments)
    assert len(points) == 4 * len(cost.segments)


def test_no_bend_is_looked_for_beyond_a_bound(cost: SegmentCost) -> None:
    here = cost.start(cost.sensitivity.current_values / cost.sensitivity.scale)
    through_no_damping = Unknowns(np.array([-20.0 * here.shared[0], 0.0, 0.0, 0.0]), np.zeros((2, 2)))
    assert cost.compute_second_derivative(here, through_no_damping) is None


def test_a_start_that_is_near_some_state_is_held_there_by_so_much_of_a_reading(cost: SegmentCost) -> None:
    scale, near = cost.sensitivity.state_scale, np.array([0.3, -2.0])
    segments = [segment._replace(prior=near) for segment in cost.segments]
    at = cost.start(cost.sensitivity.current_values / cost.sensitivity.scale)
    free, held = cost.equations(at), cost.with_changes(segments=segments).equations(at)
    assert free is not None
    assert held is not None
    off = -near / scale
    assert held.cost - free.cost == pytest.approx(2 * 0.5 * PRIOR_WEIGHT**2 * float(off @ off), rel=1e-6)
    assert held.local_gradient - free.local_gradient == pytest.approx(
        np.tile(PRIOR_WEIGHT**2 * off, (2, 1)), rel=1e-6
    )
    assert held.diagonal - free.diagonal == pytest.approx(
        np.tile(PRIOR_WEIGHT**2 * np.eye(2), (2, 1, 1)), abs=1e-9
    )
    assert (held.shared == free.shared).all()
