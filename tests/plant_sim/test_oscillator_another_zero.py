"""A constant force on a hardening spring is a spring that is not symmetric about the place to which it moves."""

from __future__ import annotations

import numpy as np
import pytest
from duffing_cases import CUBIC, GAIN, STIFFNESS, lane, multisine, simulation, stimulus

PLACE_MM = 0.05
"""Where the force holds the device at rest."""


@pytest.mark.parametrize("place", [PLACE_MM, -2.0 * PLACE_MM])
def test_velocities_are_the_same_and_displacements_differ_by_the_place(place: float) -> None:
    force = (STIFFNESS * place + CUBIC * place**3) / GAIN
    pushed, bent = simulation("drive.offset"), simulation("stiffness.quadratic")
    of_push = lane(pushed, {"drive.offset.offset": force})
    about_place = {
        "stiffness": STIFFNESS + 3.0 * CUBIC * place**2,
        "stiffness.quadratic.coefficient": 3.0 * CUBIC * place,
    }
    record = stimulus(multisine())
    found = pushed.predict(record, of_push, np.array([[place, 0.0]])).outputs
    expected = bent.predict(record, lane(bent, about_place), np.array([[0.0, 0.0]])).outputs
    size = np.abs(expected["velocity"]).max()
    assert np.abs(found["velocity"] - expected["velocity"]).max() < 1e-6 * size
    assert found["displacement"] == pytest.approx(expected["displacement"] + place, abs=1e-6)
