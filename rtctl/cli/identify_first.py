"""A model of whatever is at the end of the wire, where the user gave none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rtctl.border.errors import InputError
from rtctl.border.records import Driver
from rtctl.identification.vo2.identify import Vo2FitOptions, identify_vo2
from rtctl.measured.reading import read_dataset
from rtctl.models.vo2 import Vo2Model, write_model
from rtctl.output.progress import say
from rtctl.scenario.bundled import bundled_scenarios
from rtctl.scenario.schema import Scenario, load_scenario
from rtctl.session.acquisition import acquire


def identify_first(
    scenario: Scenario, driver: Driver, folder: Path, stop_requested: Callable[[], bool], *, quiet: bool
) -> Vo2Model:
    """Acquire by the bundled excitation through the scenario's driver, limits and clock, identify, keep both."""
    excitation, _ = load_scenario(bundled_scenarios() / "acquire_vo2.toml", [])
    if excitation.scenario.plant != scenario.scenario.plant:
        raise InputError(
            f'a "{scenario.scenario.plant}" is not identified on the way: give its model by --model or scenario.model'
        )
    excitation = excitation.model_copy(update={"clock": scenario.clock, "limits": scenario.limits})

    def report(text: str) -> None:
        say(f"  {text}", quiet=quiet)

    manifest = acquire(excitation, driver, folder / "dataset", stop_requested, report)
    model = identify_vo2(read_dataset(manifest), Vo2FitOptions(), report)
    write_model(model, folder / "model.toml")
    return model
