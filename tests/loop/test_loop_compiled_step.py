"""The compiled step is the readable one to the bit: through saturation, lost readings, changed gains, restarts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from vo2_cases import IdentifiedDevice

from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.controllers.feedforward import InverseFeedforward
from rtctl.controllers.pi import NoFeedforward, PiController, PiGains
from rtctl.estimators.gap_free import GapFreeEstimator
from rtctl.estimators.observer import ObserverEstimator
from rtctl.loop.compiled.step import CompiledStep, compiled_step
from rtctl.loop.step import Decision, ReadableStep, Step
from rtctl.models.span import Span
from rtctl.models.vo2 import Vo2Model
from rtctl.safety.limits import CommandLimits

LIMITS = (CommandLimits(low=4.0, high=7.5, safe=3.68, slew_per_s=200.0),)
STEPS = 3000
Device = Callable[[str], IdentifiedDevice]


@pytest.fixture(scope="module")
def model(identified: Device) -> Vo2Model:
    return identified("vo2_a").model


def both(model: Vo2Model, *, forward: bool) -> tuple[Step, Step]:
    """Compiled and readable, of parts of their own."""

    def parts() -> tuple[ObserverEstimator, PiController]:
        inverse = InverseFeedforward(model, Span(3.68, 8.49)) if forward else NoFeedforward()
        return ObserverEstimator(model), PiController(PiGains(kp=0.02, ki=8.0), inverse, deadband=0.05)

    compiled = compiled_step(*parts(), LIMITS)
    assert isinstance(compiled, CompiledStep)
    return compiled, ReadableStep(*parts(), LIMITS)


def bits(decision: Decision) -> list[bytes]:
    estimate, levels, terms = decision
    return [np.float64(value).tobytes() for value in (*estimate, *levels, *terms)]


@pytest.mark.parametrize("forward", [False, True])
def test_both_steps_agree_to_the_bit(model: Vo2Model, forward: bool) -> None:
    random = np.random.default_rng(7)
    low, high = model.deflection
    setpoints = low + (high - low) * (0.5 + 0.6 * np.sin(np.arange(STEPS + 1) / 150.0))
    readings = np.exp(random.uniform(math.log(model.resistance.low), math.log(model.resistance.high), STEPS))
    readings[500:520] = math.nan
    elapsed = np.where(random.random(STEPS) < 0.02, 3e-3, 1e-3)
    compiled, readable = both(model, forward=forward)
    held = 0
    for begin in (0, 1500):
        first = (model.resistance.high,)
        levels = compiled.start((3.68,), setpoints[begin], first, 1e-3)
        assert levels == readable.start((3.68,), setpoints[begin], first, 1e-3)
        for k in range(begin, begin + 1500):
            if k in (700, 2200):
                for step in (compiled, readable):
                    step.change("controller.kp", 0.05 if k == 700 else 0.0)
                    step.change("controller.ki", 20.0)
            inputs = (
                float(setpoints[k]),
                float(setpoints[k + 1]),
                levels,
                levels,
                (float(readings[k]),),
                float(elapsed[k]),
            )
            found, wanted = compiled.step(*inputs), readable.step(*inputs)
            assert bits(found) == bits(wanted), k
            levels = found.levels
            held += sum(found.terms) != levels[0]
    assert STEPS / 20 < held < STEPS, "the limits held some commands back, and not all"


@pytest.mark.parametrize("forward", [False, True])
def test_a_command_that_is_no_number_is_the_same_fault(model: Vo2Model, forward: bool) -> None:
    for step in both(model, forward=forward):
        levels = step.start((3.68,), 30.0, (model.resistance.high,), 1e-3)
        with pytest.raises(DriverError, match="no level to command") as caught:
            step.step(math.nan, math.nan, levels, levels, (5e4,), 1e-3)
        assert caught.value.fault is Fault.NOT_FINITE


def test_a_gain_that_cannot_be_is_refused_and_changes_nothing(model: Vo2Model) -> None:
    compiled, _ = both(model, forward=False)
    compiled.start((3.68,), 30.0, (model.resistance.high,), 1e-3)
    before = dict(compiled.parameters())
    with pytest.raises(InputError, match="ki > 0"):
        compiled.change("controller.ki", -1.0)
    assert dict(compiled.parameters()) == before


def test_parts_that_it_does_not_know_are_left_to_the_readable_step(model: Vo2Model) -> None:
    pi = PiController(PiGains(kp=0.02, ki=8.0), NoFeedforward(), deadband=0.0)
    assert compiled_step(GapFreeEstimator(model), pi, LIMITS) is None
    assert compiled_step(ObserverEstimator(model), pi, (replace(LIMITS[0], stop=True),)) is None
