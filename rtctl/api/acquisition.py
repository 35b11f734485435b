"""An excitation through a driver into a dataset: `acquire`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rtctl.api.datasets import read_dataset
from rtctl.api.inputs import PathText, Settings, driver_of, load_scenario, path_of
from rtctl.api.runs.watching import watched_run
from rtctl.measured.dataset import Dataset
from rtctl.output.progress import Progress, Reporter, reporter

if TYPE_CHECKING:
    from rtctl.border.records import Driver


def acquire(
    scenario: PathText | Mapping[str, Any],
    out: PathText,
    *,
    driver: str | Mapping[str, Any] | Driver | None = None,
    settings: Settings = (),
    progress: Progress = False,
) -> Dataset:
    """Play the excitations of a scenario on a device and record a dataset.

    Args:
        scenario: A scenario with [[excitation]] tables: its file, a bundled name such as "acquire_vo2", or its tables.
        out: Folder of the dataset; one that is there already is moved aside.
        driver: A kind such as "modbus-tcp", a mapping of the keys of [driver], or a driver of your own; None: the
            scenario's.
        settings: Keys of the scenario to override.
        progress: True shows a bar, a callable hears (text, share that is done or None).

    Returns:
        The dataset; `dataset.path` is its manifest in `out`.

    Raises:
        InputError: The scenario is wrong, or no device is at the port.
        RunError: The device or the wire failed; records that were complete are written.
    """
    from rtctl.scenario.command_sequence import steps_of
    from rtctl.session import acquisition
    from rtctl.wiring import build_driver

    folder, report = path_of("out", out), reporter(progress)
    own = driver_of(driver)
    loaded = load_scenario(scenario, settings, {"driver": None if own is not None else driver})
    device = own or build_driver(loaded.scenario, loaded.folder)
    title = loaded.scenario.scenario.title
    with watched_run(title, steps_of(loaded.scenario), report) as stop_requested:
        manifest = acquisition.acquire(
            loaded.scenario, device, folder, stop_requested, report.say, lambda: _make_room(folder, report),
            loaded.tables,
        )  # fmt: skip
    return read_dataset(manifest)


def _make_room(folder: Path, report: Reporter) -> None:
    """Move a dataset that `folder` holds aside, and say so."""
    from rtctl.measured.backup import put_aside

    if (aside := put_aside(folder)) is not None:
        report.say(f"{folder} held a dataset: it was moved to {aside}")
