"""Excitations visit what they promise: turning points, bounds, holds; random ones are their seed's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from rtctl.signals.excitations import (
    CurrentSine,
    DampedOscillation,
    LevelSequence,
    RandomStaircase,
    ReversalCurves,
    sweep,
)

LOW, HIGH, PERIOD_S = 4.0, 8.0, 1e-3
points = st.lists(st.floats(0.0, 10.0), min_size=1, max_size=8)


def turns(values: np.ndarray) -> list[float]:
    """First, last and every local extreme of a staircase."""
    steps = values[np.insert(np.diff(values) != 0.0, 0, True)]
    inner = [b for a, b, c in zip(steps, steps[1:], steps[2:], strict=False) if (b - a) * (c - b) < 0.0]
    return [float(steps[0]), *map(float, inner), float(steps[-1])]


@given(points, st.floats(0.01, 5.0))
def test_a_sweep_meets_its_turning_points_in_steps_no_larger_than_asked(
    turning_points: list[float], step: float
) -> None:
    stairs = sweep(turning_points, step)
    assert np.all(np.abs(np.diff(stairs)) <= step * (1 + 1e-6))
    rest = iter(stairs.tolist())
    assert all(point in rest for point in turning_points), "each of them exactly, in their order"


@pytest.mark.parametrize("step", [0.0, -1.0, float("nan")])
def test_a_sweep_without_a_step_is_refused(step: float) -> None:
    with pytest.raises(ValueError, match=r"excitation\.step must be > 0"):
        sweep([1.0, 2.0], step)


def test_a_sweep_of_whole_steps_has_no_extra_one() -> None:
    assert sweep([0.0, 0.1 + 0.2], 0.1).tolist() == pytest.approx([0.0, 0.1, 0.2, 0.3])


def test_a_damped_oscillation_closes_in_on_its_centre() -> None:
    excitation = DampedOscillation.model_validate(
        {"hold": "3 ms", "cycles": 4, "step": "2 %", "centre": "75 %"}
    )
    current = excitation.build(LOW, HIGH, PERIOD_S)
    stairs = current.reshape(-1, 3)
    assert np.all(stairs == stairs[:, :1]), "every value is held for three samples"
    wanted = [4.0, 8.0, 4.0, 7.75, 4.75, 7.5, 5.5, 7.25, 6.25]
    assert turns(current) == pytest.approx(wanted)
    assert current.min() == LOW
    assert current.max() == HIGH


def test_reversal_curves_return_to_both_ends() -> None:
    excitation = ReversalCurves.model_validate({"hold": "1 ms", "curves": 3, "span": ["25 %", "75 %"]})
    current = excitation.build(LOW, HIGH, PERIOD_S)
    wanted = [4.0, 5.0, 4.0, 6.0, 4.0, 7.0, 4.0, 8.0, 7.0, 8.0, 6.0, 8.0, 5.0, 8.0]
    assert turns(current) == pytest.approx(wanted)


def staircase(**tables: object) -> np.ndarray:
    raw = {"hold": "2 ms", "levels": 500, "seed": 3, **tables}
    return RandomStaircase.model_validate(raw).build(LOW, HIGH, PERIOD_S)


def test_a_random_staircase_is_its_seed() -> None:
    np.testing.assert_array_equal(staircase(), staircase())
    assert np.all(staircase() != staircase(seed=4))


def test_a_random_staircase_is_uniform_between_its_levels() -> None:
    values = staircase(low="25 %", high="6 mA")[::2]
    assert values.shape == (500,)
    assert 5.0 <= values.min() < 5.01
    assert 5.99 < values.max() <= 6.0
    assert abs(values.mean() - 5.5) < 4.0 * (1.0 / np.sqrt(12 * 500)), "four standard errors"


def test_a_sequence_is_repeated_as_a_whole() -> None:
    excitation = LevelSequence.model_validate(
        {"hold": "2 ms", "levels": ["0 %", "5000 uA", "100 %"], "times": 2}
    )
    wanted = 2 * [4.0, 4.0, 5.0, 5.0, 8.0, 8.0]
    assert excitation.build(LOW, HIGH, PERIOD_S).tolist() == pytest.approx(wanted)


def test_a_sine_starts_at_its_minimum() -> None:
    excitation = CurrentSine.model_validate({"duration": "0.2 s", "frequency": "10 Hz", "amplitude": "25 %"})
    current = excitation.build(LOW, HIGH, PERIOD_S)
    assert current.shape == (200,)
    assert (current[0], current[50], current[100]) == pytest.approx((5.0, 7.0, 5.0))
    assert (current.min(), current.max()) == pytest.approx((5.0, 7.0))


def test_a_hold_shorter_than_a_period_is_refused() -> None:
    with pytest.raises(ValueError, match="shorter than the loop's period"):
        staircase(hold="0.1 ms")


@pytest.mark.parametrize(
    "tables", [{"levels": 0}, {"seed": -1}, {"hold": "nan s"}, {"low": "1 um"}, {"use": "train"}, {"sed": 1}]
)
def test_what_cannot_be_played_is_refused(tables: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        staircase(**tables)
