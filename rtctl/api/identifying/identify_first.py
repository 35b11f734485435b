"""A model of whatever is at the end of the wire, where the user gave none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from rtctl.api.identifying.fit import Fit
from rtctl.border.errors import InputError, RunError
from rtctl.border.records import Driver
from rtctl.measured.reading import read_dataset
from rtctl.output.progress import Reporter
from rtctl.registry import plant_kind
from rtctl.scenario.bundled import bundled_scenarios
from rtctl.scenario.schema import Scenario, load_scenario
from rtctl.session.acquisition import acquire


def identify_first(
    scenario: Scenario,
    driver: Driver,
    folder: Path,
    stop_requested: Callable[[], bool],
    report: Callable[[str], None],
) -> Any:
    """Identify the device at the scenario's driver, within the scenario's limits and clock.

    Args:
        scenario: What is to be run afterwards.
        driver: The way to the device; it is closed afterwards.
        folder: Where the dataset and `model.toml` are kept.
        stop_requested: Asked once an exchange; True ends the acquisition.
        report: Hears each stage.

    Raises:
        InputError: Only a device of the bundled excitation's kind is identified without a model.
        RunError: The acquisition failed, or the model does not follow the data.
    """
    record = plant_kind(scenario.scenario.plant)
    identification = record.identification
    if identification is None or not identification.excitation:
        raise InputError(
            f'a "{record.name}" is not identified on the way: give its model by --model or scenario.model'
        )
    excitation, tables = load_scenario(bundled_scenarios() / f"{identification.excitation}.toml", [])
    excitation = excitation.model_copy(update={"clock": scenario.clock, "limits": scenario.limits})

    def indented(text: str) -> None:
        report(f"  {text}")

    manifest = acquire(excitation, driver, folder / "dataset", stop_requested, indented, tables=tables)
    options = record.part(identification.options)()
    listener = Reporter(quiet=False, listener=lambda text, share: None if share else indented(text))
    fit: Fit = record.part(identification.fit)(read_dataset(manifest), None, options, listener)
    for warning in fit.warnings:
        indented(f"note: {warning}")
    fit.save(folder / "model.toml")
    if not fit.trusted:
        raise RunError(
            "the model that was identified on the way is not to be trusted, so nothing was run with it: "
            f"{'; '.join(fit.warnings)}"
        )
    return fit.model.content
