"""A drift that is over early changes by as much as one that goes on: its first rate is within what a fit may reach."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from plant_sim.oscillator.mechanisms import MECHANISMS as OF_OSCILLATORS
from rtctl.border.mechanisms import Parameter, drift_of
from rtctl.simulations.vo2.mechanisms import MECHANISMS as OF_VO2
from rtctl.simulations.vo2.mechanisms.sensor.ageing import slowed_s

COURSES = {"settling_time": lambda t, d: float(drift_of(np.array(t), d)), "slowing_time": slowed_s}
"""What has passed after t [s], over the first rate, of a drift that settles, or slows down, within d [s]."""
DURATION_S = 40.0


def drifts() -> list[tuple[str, Parameter, Parameter]]:
    """Mechanism, first rate and time of all drifts that come to an end."""
    found = []
    for catalogue in (OF_OSCILLATORS, OF_VO2):
        for name, one in catalogue.items():
            own = {parameter.name: parameter for parameter in one.parameters}
            found += [(name, own["rate"], own[time]) for time in COURSES if time in own and "rate" in own]
    return found


@pytest.mark.parametrize(
    ("name", "rate", "time"), drifts(), ids=lambda one: one if isinstance(one, str) else ""
)
def test_the_first_rate_reaches_as_far_as_that_of_a_steady_drift(
    name: str, rate: Parameter, time: Parameter
) -> None:
    """Contacts that age by 40 % with a slowing time of a thousandth of the record were out of reach: 3 % were not."""
    shortest_s = time.shape_range[0] * time.scale(SimpleNamespace(duration=DURATION_S))
    passed_s = COURSES[time.name](DURATION_S, shortest_s)
    assert rate.reach * passed_s >= 0.99 * DURATION_S, name


def test_there_are_such_drifts_in_both_catalogues() -> None:
    names = {name for name, _, _ in drifts()}
    assert {
        "sensor.drift",
        "input.gain_drift",
        "stiffness.drift",
        "thermal.ambient_drift",
        "sensor.ageing",
    } <= names
