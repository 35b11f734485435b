"""The Prandtl-Ishlinskii operator from its turning points, against the sum of plays that defines it."""

from __future__ import annotations

import numpy as np
import pytest
from duffing_cases import FloatArray

from plant_sim.oscillator.integration.turning_points import (
    COUNT,
    DEEPEST,
    arrive,
    farthest_before,
    follow_turning_points,
    rest,
    rise_from_rest,
)

DENSITY = 0.2
PLAYS = 4000


def followed(u: FloatArray, fading: float, state: FloatArray | None = None) -> FloatArray:
    """H behind a drive whose number of samples is a multiple of 3."""
    more = np.empty((len(u) // 3, 3))
    follow_turning_points(rest() if state is None else state, u.reshape(-1, 3), DENSITY, fading, more)
    return more.ravel()


def by_plays(u: FloatArray, fading: float) -> FloatArray:
    """The definition: plays of all thresholds, each from the middle of its play at no drive."""
    thresholds = (np.arange(PLAYS) + 0.5) / PLAYS * np.abs(u).max()
    weights = DENSITY * np.exp(-fading * thresholds) * (thresholds[1] - thresholds[0])
    play, found = np.zeros(PLAYS), []
    for one in u:
        play = np.clip(play, one - thresholds, one + thresholds)
        found.append(weights @ play)
    return np.array(found)


def drives() -> dict[str, FloatArray]:
    """Drives with loops within loops."""
    t = np.linspace(0.0, 40.0, 900)
    return {
        "random": 0.3 * np.cumsum(np.random.default_rng(0).standard_normal(900)),
        "dying away": 3.0 * np.exp(-t / 15.0) * np.cos(2.0 * t),
        "growing": 0.1 * t * np.sin(2.0 * t) + 0.5,
        "jumping": np.repeat(np.random.default_rng(1).uniform(-3.0, 3.0, 90), 10),
        "held": np.full(900, -1.5),
    }


@pytest.mark.parametrize("fading", [0.0, 1e-4, 0.5, 4.0])
@pytest.mark.parametrize("name", drives())
def test_it_is_the_sum_of_all_plays(name: str, fading: float) -> None:
    u = drives()[name]
    wanted = by_plays(u, fading)
    assert followed(u, fading) == pytest.approx(wanted, abs=3e-6 * np.abs(wanted).max())


def test_it_depends_on_no_time_and_closes_its_loops() -> None:
    up, down = np.linspace(0.0, 3.0, 31), np.linspace(3.0, -1.0, 41)
    path = np.concatenate((up, down, np.linspace(-1.0, 2.0, 31), np.linspace(2.0, -1.0, 31), [-1.0]))
    slow = np.repeat(path, 3)
    found, late = followed(path, 0.3), followed(slow, 0.3)
    assert late[::3] == pytest.approx(found, abs=1e-14)
    assert found[len(up) + len(down) - 1] == pytest.approx(found[-1], abs=1e-14), "back where the loop began"


def test_steps_as_they_come_are_those_of_a_whole_record() -> None:
    u, state = drives()["random"], rest()
    parts = [followed(part, 0.5, state) for part in np.split(u, 10)]
    assert np.concatenate(parts) == pytest.approx(followed(u, 0.5), abs=1e-13)


def test_a_loop_deeper_than_is_remembered_changes_little() -> None:
    t = np.arange(600)
    u, state = 3.0 * 0.97**t * (-1.0) ** t, rest()
    assert followed(u, 0.0, state) == pytest.approx(by_plays(u, 0.0), abs=1e-4)
    assert state[COUNT] == DEEPEST


@pytest.mark.parametrize("fading", [0.0, 0.3])
@pytest.mark.parametrize("first", [0.0, -1.0, 0.7])
@pytest.mark.parametrize("remanence", [0.05, -0.05])
def test_it_arrives_with_its_remanence_and_forgets_it_beyond_the_drive_that_left_it(
    remanence: float, first: float, fading: float
) -> None:
    state = arrive(first, remanence, 30.0, DENSITY, fading)
    rested = np.sign(first) * rise_from_rest(abs(first), DENSITY, fading)
    assert followed(np.full(3, first), fading, state) == pytest.approx(rested + remanence, abs=1e-9)
    assert followed(np.full(3, 29.0), fading, state) == pytest.approx(rise_from_rest(29.0, DENSITY, fading))


def test_no_more_is_left_than_the_farthest_drive_leaves() -> None:
    state = arrive(0.0, 50.0, 2.0, DENSITY, 0.0)
    assert followed(np.zeros(3), 0.0, state) == pytest.approx(DENSITY * 2.0**2 / 4.0)


@pytest.mark.parametrize("fading", [0.0, 0.3])
def test_a_device_that_is_served_may_have_what_any_drive_leaves(fading: float) -> None:
    state = arrive(0.0, 0.1, farthest_before(0.1, DENSITY, fading), DENSITY, fading)
    assert followed(np.zeros(3), fading, state) == pytest.approx(0.1, abs=1e-9)
    assert farthest_before(0.0, DENSITY, fading) == 0.0
