"""A model of whatever is at the end of the wire, where the user gave none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rtctl.border.errors import InputError
from rtctl.border.records import Driver
from rtctl.identification.vo2.identify import Vo2FitOptions, identify_vo2
from rtctl.measured.reading import read_dataset
from rtctl.models.vo2 import Vo2Model, write_model
from rtctl.scenario.bundled import bundled_scenarios
from rtctl.scenario.schema import Scenario, load_scenario
from rtctl.session.acquisition import acquire


def identify_first(
    scenario: Scenario,
    driver: Driver,
    folder: Path,
    stop_requested: Callable[[], bool],
    report: Callable[[str], None],
) -> Vo2Model:
    """Identify the device at the scenario's driver, within the scenario's limits and clock.

    Args:
        scenario: What is to be run afterwards.
        driver: The way to the device; it is closed afterwards.
        folder: Where the dataset and `model.toml` are kept.
        stop_requested: Asked once an exchange; True ends the acquisition.
        report: Hears each stage.

    Raises:
        InputError: Only a device of the bundled excitation's kind is identified without a model.
        RunError: The acquisition failed.
    """
    excitation, _ = load_scenario(bundled_scenarios() / "acquire_vo2.toml", [])
    if excitation.scenario.plant != scenario.scenario.plant:
        raise InputError(
            f'a "{scenario.scenario.plant}" is not identified on the way: give its model by --model or scenario.model'
        )
    excitation = excitation.model_copy(update={"clock": scenario.clock, "limits": scenario.limits})

    def indented(text: str) -> None:
        report(f"  {text}")

    manifest = acquire(excitation, driver, folder / "dataset", stop_requested, indented)
    model = identify_vo2(read_dataset(manifest), Vo2FitOptions(), indented)
    write_model(model, folder / "model.toml")
    return model
