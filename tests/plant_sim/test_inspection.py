"""What a plant really does can be looked at, and its hidden effects switched while it runs: the state goes on."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from plant_sim.catalogue import bundled_plant
from plant_sim.equations.plant import load_plant as equations_plant
from plant_sim.inspection import NoInspection, inspection_of
from plant_sim.oscillator.plant import load_plant as oscillator_plant
from plant_sim.vo2.effects.inspection import UNITS
from plant_sim.vo2.effects.table import Effects
from rtctl.border.errors import InputError

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def test_every_effect_of_the_table_can_be_switched() -> None:
    assert UNITS.keys() == Effects.model_fields.keys()


def test_a_delay_that_is_switched_on_is_that_of_a_device_that_has_it(make_device, silent) -> None:
    device, late = make_device("vo2_a", silent), make_device("vo2_a", silent | {"effects": {"delay": "3 ms"}})
    inspection = device.inspection()
    assert inspection.values()["effects.delay"] == 0.0
    for one in (device, late):
        for _ in range(20):
            one.step((5.0,), 1e-3)
    inspection.check("effects.delay", 3e-3)
    inspection.switch("effects.delay", 3e-3)
    for k in range(30):
        level = (5.0 + 2.0 * math.sin(k / 5.0),)
        assert device.step(level, 1e-3)[1] == pytest.approx(late.step(level, 1e-3)[1], abs=0.02)
    deflection, resistance, temperature, acting, *_ = inspection.truth()
    assert (deflection, resistance) == (device.deflection_um, device.resistance_ohm)
    assert (temperature, acting) == (device.temperature_degC, np.float32(5.0 + 2.0 * math.sin(26 / 5.0)))


def test_a_drift_begins_when_it_is_switched_on_and_goes_on_when_another_one_is(make_device, silent) -> None:
    device = make_device("vo2_a", silent)
    inspection = device.inspection()
    device.advance((0.0,), 100.0)
    inspection.switch("effects.warming", 2.0)
    device.advance((0.0,), 0.5)
    assert device.temperature_degC == pytest.approx(24.0)
    inspection.switch("effects.ageing", 1e-3)
    device.advance((0.0,), 0.5)
    assert device.temperature_degC == pytest.approx(25.0)
    inspection.switch("effects.warming", 0.0)
    device.advance((0.0,), 0.1)
    assert device.temperature_degC == pytest.approx(23.0), "off is off"


def test_a_mode_that_is_switched_on_begins_at_rest(make_device, silent) -> None:
    device = make_device("vo2_a", silent)
    inspection = device.inspection()
    device.advance((7.0,), 0.1)
    before = device.deflection_um
    inspection.switch("effects.swing_share", 1.0)
    device.advance((7.0,), 1e-3)
    assert device.deflection_um == pytest.approx(before, abs=1e-6)


@pytest.mark.parametrize(("name", "value"), [("delay", 5.0), ("second_share", 2.0), ("swing_frequency", 0.0)])
def test_an_effect_out_of_range_is_refused_in_words(make_device, name: str, value: float) -> None:
    with pytest.raises(InputError, match=rf'effects: key "{name}"'):
        make_device("vo2_a").inspection().check(f"effects.{name}", value)


def test_friction_that_is_switched_on_stops_a_beam_that_goes_on_from_where_it_was() -> None:
    path = bundled_plant("beam_rm5")
    plain, rubbed = oscillator_plant(path), oscillator_plant(path)
    inspection = rubbed.inspection()
    assert inspection.truths == (("true_displacement", "mm"), ("true_velocity", "mm/s"))
    for one in (plain, rubbed):
        one.step((10.0,), 20e-3)
    assert inspection.truth() == (plain.displacement, plain.velocity)
    inspection.check("effects.friction.coulomb.level", 1000.0)
    inspection.switch("effects.friction.coulomb.level", 1000.0)
    assert inspection.values()["effects.friction.coulomb.level"] == 1000.0
    assert inspection.truth() == (plain.displacement, plain.velocity), "nothing jumps"
    for one in (plain, rubbed):
        one.advance((0.0,), 1.0)
    assert abs(rubbed.velocity) < 1e-6 < abs(plain.velocity)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("friction.coulomb.level", -1.0, "must lie between"),
        ("hysteresis.bouc_wen.level", 1.0, "set it before the mechanism acts"),
    ],
)
def test_what_an_oscillator_cannot_have_is_refused_in_words(name: str, value: float, words: str) -> None:
    with pytest.raises(InputError, match=words):
        oscillator_plant(bundled_plant("beam_rm5")).inspection().check(f"effects.{name}", value)


def test_a_parameter_of_equations_is_another_one_from_now_on() -> None:
    plant = equations_plant(SCENARIOS / "models/equations/heated_body.toml")
    inspection = plant.inspection()
    names = [name for name, _ in inspection.truths]
    assert names[0].startswith("true_")
    assert any(name.startswith("state_") for name in names)
    first = next(iter(inspection.switches))
    before = inspection.values()[first]
    inspection.check(first, 1.1 * before)
    inspection.switch(first, 1.1 * before)
    assert inspection.values()[first] == pytest.approx(1.1 * before)
    assert len(inspection.truth()) == len(names)


def test_a_plant_without_inspection_is_served_all_the_same() -> None:
    inspection = inspection_of(object())
    assert isinstance(inspection, NoInspection)
    assert (inspection.truth(), dict(inspection.values())) == ((), {})
