"""What a film has been through goes from one estimator to the next: turning points that a model would not have made."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from vo2_model_cases import small_model

from rtctl.border.model_file import MechanismTable, Value
from rtctl.controllers.extended_feedforward import ExtendedFeedforward
from rtctl.controllers.feedforward import InverseFeedforward
from rtctl.estimators import observer_of
from rtctl.models.span import Span
from rtctl.models.vo2 import Vo2Model
from rtctl.plants.vo2.doubt.path_run import PathRun
from rtctl.simulations.vo2.loop_dynamics import dynamics_of, loop_dynamics

PERIOD_S = 1e-3
LAG_S = 4e-3


def lagging() -> Vo2Model:
    """The small model whose transition lags."""
    table = MechanismTable(
        id="hysteresis.rate_dependence", parameters={"time_constant": Value(value=LAG_S, unit="s")}
    )
    return dataclasses.replace(small_model(), mechanisms=(table,))


def course() -> tuple[np.ndarray, int]:
    """Return a current with one short peak, then a narrow motion, and the sample at which the device changes."""
    k = np.arange(6000)
    current = 6.4 + 0.25 * np.sin(2.0 * np.pi * 1e-2 * k)
    current[:4] = 8.4  # a peak that a lagging film does not follow
    return current, 3000


def recorded() -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Return current, resistance and deflection of a device whose transition lags from a sample on."""
    current, changed = course()
    path = PathRun(small_model(), loop_dynamics(small_model()))
    path.start(3.7)
    first = path.run(current[:changed], np.full(changed, PERIOD_S), np.zeros(changed))
    late = PathRun(lagging(), loop_dynamics(lagging()))
    late.start(3.7)
    late._film[:], late._beam[:] = path._film, path._beam
    late._x[:] = path._x
    rest = len(current) - changed
    second = late.run(current[changed:], np.full(rest, PERIOD_S), np.zeros(rest))
    log_read, bent, _ = np.concatenate([first, second], axis=1)
    return current, np.exp(log_read), bent, changed


@pytest.mark.parametrize("inherits", [True, False])
def test_an_estimator_that_inherits_senses_as_one_that_was_there(inherits: bool) -> None:
    current, resistance, bent, changed = recorded()
    before, heir = observer_of(small_model()), observer_of(lagging())
    before.start((3.7,), (resistance[0],))
    heir.start((3.7,), (resistance[0],))
    off = []
    for k in range(len(current)):
        if k < changed:
            before.step((current[k],), (resistance[k],), PERIOD_S)
        elif k == changed and inherits:
            heir.inherit(before.film_memory())
        off.append(heir.step((current[k],), (resistance[k],), PERIOD_S).value - bent[k])
    error = float(np.abs(off[changed + 500 :]).mean())
    assert (error < 0.05) if inherits else (error > 0.2), error


def test_going_back_the_memory_goes_back_too() -> None:
    current, resistance, _, changed = recorded()
    before, heir, again = observer_of(small_model()), observer_of(lagging()), observer_of(small_model())
    for one in (before, heir, again):
        one.start((3.7,), (resistance[0],))
    for k in range(changed):
        before.step((current[k],), (resistance[k],), PERIOD_S)
    heir.inherit(before.film_memory())
    again.inherit(heir.film_memory())
    for one, other in zip(again.film_memory(), before.film_memory(), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)


def test_a_feedforward_inherits_too() -> None:
    memory = observer_of(small_model()).film_memory()
    memory.beam[:3] = (1.0, 3.0, 8.0)
    plain = InverseFeedforward(small_model(), Span(3.7, 8.5))
    late = ExtendedFeedforward(lagging(), dynamics_of(lagging()), Span(3.7, 8.5))
    for one in (plain, late):
        one.start(3.7)
        one.inherit(memory)
    assert plain.memory[int(plain.memory[0]) + 1 :][:3].tolist() == [1.0, 3.0, 8.0]
    assert late.memory.forward_beam[:3].tolist() == [1.0, 3.0, 8.0]


def test_what_the_filter_believed_of_another_device_is_forgotten() -> None:
    """An estimator that followed commands under a model of later has taken the difference for heat."""
    heir = observer_of(lagging())
    heir.start((3.7,), (1e5,))
    heir.memory.filter[2:4] = (3.0, 0.2)
    memory = observer_of(small_model()).film_memory()
    heir.inherit(memory._replace(filter=np.empty(0)))
    assert heir.memory.filter[2:4].tolist() == [0.0, 0.0]
    heir.inherit(memory._replace(filter=np.arange(memory.filter.size) + 1.0))
    assert heir.memory.filter[2:4].tolist() == [1.0, 2.0]
