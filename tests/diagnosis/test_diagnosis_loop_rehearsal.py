"""A model that would make the loop sense worse is not handed out; what it is worth to the loop is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from vo2_cases import IdentifiedDevice

from rtctl.border.model_file import Value
from rtctl.diagnosis.verification.loop_model import compare_in_loop
from rtctl.measured.dataset import Record
from rtctl.models.vo2 import Vo2Model
from rtctl.models.vo2_extensions import CORRECTION_UNITS
from rtctl.plants.vo2.rehearsal import rehearse_sensing
from rtctl.simulations.vo2 import vo2_simulation
from rtctl.simulations.vo2.extending import extended_model

UNITS = {"current": "mA", "resistance": "ohm", "deflection": "um"}


@pytest.fixture(scope="module")
def device(identified: Callable[[str], IdentifiedDevice]) -> IdentifiedDevice:
    return identified("vo2_a")


def lagging(record: Record, time_constant_s: float) -> Record:
    """The same device behind an instrument of the first order for its resistance."""
    readings, share = record.signals["resistance"], -np.expm1(-record.period_s / time_constant_s)
    rest = [(1.0 - share) * readings[0]]
    behind, _ = lfilter([share], [1.0, share - 1.0], readings, zi=rest)
    return replace(record, signals={**record.signals, "resistance": behind})


def test_the_loop_senses_better_with_an_effect_that_acts_and_worse_with_one_that_does_not(
    device: IdentifiedDevice,
) -> None:
    model = device.model
    made = vo2_simulation(model, UNITS, "m").extended(("sensor.lag",))
    values = np.array([one.value for one in made.parameters])
    values[-1] = 5e-3
    extended = extended_model(made.with_values(values))
    tests = [replace(device.unseen, use="test")]
    wrong = rehearse_sensing(model, extended, tests)
    assert wrong is not None
    assert wrong.after > 1.5 * wrong.before
    right = rehearse_sensing(model, extended, [lagging(one, 5e-3) for one in tests])
    assert right is not None
    assert right.after < 0.8 * right.before


def corrected(model: Vo2Model, **values: float) -> Vo2Model:
    """The model with corrections of its signals."""
    units = {name: CORRECTION_UNITS[name] for name in values}
    return replace(model, corrections={name: Value(value=values[name], unit=units[name]) for name in values})


def test_corrections_stay_only_where_the_loop_senses_better_with_them(device: IdentifiedDevice) -> None:
    """An offset that took up an error of the loops goes; a current that has changed by 2 % stays."""
    tests = [replace(device.unseen, use="test")]
    model = device.model
    rehearsal, is_plain = compare_in_loop(
        rehearse_sensing, model, corrected(model, current_offset=0.03), model, tests
    )
    assert is_plain
    assert rehearsal is not None
    assert rehearsal.with_corrections is not None
    assert rehearsal.after < rehearsal.with_corrections
    read = {**device.unseen.signals, "current": device.unseen.signals["current"] / 1.02}
    weaker = [replace(device.unseen, use="test", signals=read)]
    rehearsal, is_plain = compare_in_loop(
        rehearse_sensing, model, corrected(model, current_gain=1.02), model, weaker
    )
    assert not is_plain
    assert rehearsal is not None
    assert rehearsal.with_corrections is None
    assert rehearsal.after < 0.6 * rehearsal.before


def test_records_without_a_deflection_and_those_of_a_fit_rehearse_nothing(device: IdentifiedDevice) -> None:
    blind = {name: values for name, values in device.unseen.signals.items() if name != "deflection"}
    for record in (device.unseen, replace(device.unseen, use="test", signals=blind)):
        assert rehearse_sensing(device.model, device.model, [record]) is None
