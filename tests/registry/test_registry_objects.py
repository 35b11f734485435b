"""Parts of a user handed to `rtctl.run` as classes and objects, without a name."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from heater_scenario import TEXT

import rtctl
from rtctl.interfaces import ControlAction, Estimate, Setup
from rtctl.registry import entries


class Proportional:
    """A controller that nobody registered."""

    terms = (("proportional", "K"),)

    def __init__(self, gain: float = 0.3) -> None:
        self._gain = gain

    def start(self, levels: Sequence[float], setpoint: float, estimate: Estimate) -> None:
        pass

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        error = setpoint - estimate.value
        return ControlAction((setpoint / 4.0 + self._gain * error,), (error,))

    def applied(self, levels: Sequence[float]) -> None:
        pass


class Biased:
    """An estimator that is wrong by a known amount."""

    surrogate = ("unbiased", "K")

    def __init__(self, bias: float = 1.0) -> None:
        self._bias = bias

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        return Estimate(sensed[0] + self._bias, sensed[0], math.nan, 0)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        return self.start(levels, sensed)


@pytest.fixture
def scenario(own_parts: Path) -> dict[str, Any]:
    rtctl.load_plugin(own_parts)
    return tomllib.loads(TEXT)


def test_a_class_and_an_object_are_used_as_they_are(scenario: dict[str, Any]) -> None:
    made: list[Setup] = []

    def with_setup(setup: Setup) -> Proportional:
        made.append(setup)
        return Proportional()

    by_class = rtctl.run(scenario, controller=Proportional, estimator=Biased(2.0))
    assert by_class.scenario.controller.kind.endswith("test_registry_objects.Proportional")
    assert by_class.summary["self_sensing"]["mean_abs"] == pytest.approx(2.0, abs=1e-4)
    by_function = rtctl.run(scenario, controller=with_setup, estimator=Biased(2.0))
    assert made[0].high == (8.0,)
    assert (by_function.signals["temperature"] == by_class.signals["temperature"]).all()


def test_options_stand_beside_the_class(scenario: dict[str, Any]) -> None:
    errors = [
        rtctl.run(scenario, controller={"kind": Proportional, "gain": gain}).summary["tracking"]["mean_abs"]
        for gain in (0.0, 1.0)
    ]
    assert errors[1] < 0.9 * errors[0]
    with pytest.raises(rtctl.InputError, match=r'unknown key "controller.gian".*did you mean "gain"'):
        rtctl.run(scenario, controller={"kind": Proportional, "gian": 1.0})


def test_a_registered_class_keeps_its_name(scenario: dict[str, Any]) -> None:
    (own,) = [entry for entry in entries("controller") if entry.name == "integral"]
    assert rtctl.run(scenario, controller=own.value).scenario.controller.kind == "integral"


def test_two_signals_of_one_name_are_refused(scenario: dict[str, Any]) -> None:
    class Reading(Biased):
        surrogate = ("reading", "K")

    class Index(Proportional):
        terms = (("index", "K"),)

    with pytest.raises(
        rtctl.InputError, match=r'surrogate of the estimator: "reading" is the name of another'
    ):
        rtctl.run(scenario, estimator=Reading)
    with pytest.raises(rtctl.InputError, match=r'terms of the controller: "index" is the name of another'):
        rtctl.run(scenario, controller=Index)


@pytest.mark.parametrize("part", [object(), object, 3, None.__class__])
def test_what_is_no_controller_is_refused(scenario: dict[str, Any], part: Any) -> None:
    with pytest.raises(rtctl.InputError, match=r"lacks"):
        rtctl.run(scenario, controller=part)


@pytest.mark.parametrize(("settings", "seen"), [({}, 7), ({"driver.seed": 3}, 3)])
def test_a_plant_keeps_its_own_seed_unless_another_is_asked_for(
    scenario: dict[str, Any], settings: dict[str, int], seen: int
) -> None:
    seeds: list[int] = []
    heater = next(entry for entry in entries("plant") if entry.name == "heater").value.device

    class Seeded(heater):  # type: ignore[misc,valid-type]
        profile = replace(heater.profile, kind="seeded")

        def __init__(self, seed: int = 7) -> None:
            super().__init__()
            seeds.append(seed)

    rtctl.register("plant", "seeded", Seeded)
    scenario["scenario"]["plant"] = scenario["driver"]["device"] = "seeded"
    rtctl.run(scenario, settings=settings)
    assert seeds == [seen]
