"""`drive.lag`: time_constant x' = u - x drives instead of u."""

from __future__ import annotations

import numpy as np

from plant_sim.oscillator.linear import linear_response, propagator
from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values, coefficient


def lagging(drive: Driven, p: Values) -> Driven:
    """A first-order follower, exact for a drive quadratic over each step; settled on the first value."""
    if p["time_constant"] <= 0.0:
        return drive
    a, b = np.array([[-1.0 / p["time_constant"]]]), np.array([1.0 / p["time_constant"]])
    nodes, h = drive.nodes, drive.step_s
    ends = linear_response(a, b, nodes, h, start=nodes[0, :1])[:, 0]
    halves = np.column_stack(
        (nodes[:, 0], 0.375 * nodes[:, 0] + 0.75 * nodes[:, 1] - 0.125 * nodes[:, 2], nodes[:, 1])
    )
    state, weights = propagator(a, b, 0.5 * h)
    middle = state[0, 0] * ends[:-1] + halves @ weights[0]
    return drive._replace(nodes=np.column_stack((ends[:-1], middle, ends[1:])))


MECHANISM = OscillatorMechanism(
    id="drive.lag",
    statement="The drive lags with a time constant of {time_constant}.",
    parameters=(coefficient("time_constant", "s", "of the lag", lambda s: 1.0 / s.rate, low=0.0),),
    drive=lagging,
    stage=6,
)
