"""Acquisition: play excitations through a driver and write what it measures as a dataset.

The rows of the loop become rows of a dataset. In lockstep a reading is from the end of the period of its own command,
so the outputs move down by one row; live it is from before the command, as a dataset has it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError, RtctlError, RunError
from rtctl.border.records import Channel, DeviceStatus, Driver, Measurement
from rtctl.measured.backup import dataset_files
from rtctl.measured.dataset import Record
from rtctl.measured.manifest.signal_kinds import measured_kinds
from rtctl.measured.writer import write_dataset
from rtctl.output.own_files import refuse_foreign
from rtctl.registry import plant_kind
from rtctl.scenario.command_sequence import command_sequences
from rtctl.scenario.schema import Scenario
from rtctl.session.live.under_way import excitation_under_way
from rtctl.session.loop_setup import closed_on_error, open_driver
from rtctl.session.open_loop import OpenLoopRun, play
from rtctl.session.run_folder import watch_words


def acquire(
    scenario: Scenario,
    driver: Driver,
    folder: Path,
    stop_requested: Callable[[], bool],
    report: Callable[[str], None],
    make_room: Callable[[], None] = lambda: None,
    tables: Mapping[str, Any] | None = None,
) -> Path:
    """Play every excitation, write the dataset and return the path of its manifest.

    Records that were complete before a fault are written all the same, and the message says so.

    Args:
        scenario: the checked scenario, with at least one `[[excitation]]`.
        driver: the driver of the device, closed.
        folder: where the dataset goes.
        stop_requested: returns True once the run is to end.
        report: takes a line of progress before each excitation.
        make_room: called once there is something to write, since what `folder` holds will be overwritten.
        tables: the scenario as a file has it; with it the excitation under way can be watched and stopped.

    Raises:
        InputError: there is nothing to play, or the plant has no dataset, or a file of another origin is in the way.
        RunError: a fault ended a record.
    """
    if not scenario.excitation:
        raise InputError("the scenario has no [[excitation]] table: nothing to play")
    if scenario.scenario.plant not in measured_kinds():
        raise InputError(
            f'a "{scenario.scenario.plant}" has no dataset: those are of {", ".join(measured_kinds())}; play the '
            "excitation with rtctl run, which records every channel"
        )
    kept = dataset_files(folder)  # moved aside, whoever made them
    for index, one in enumerate(scenario.excitation):
        if (path := folder / f"{_name(index, one.kind)}.parquet") not in kept:
            refuse_foreign(path, "acquire")
    player = _Player(scenario, driver, stop_requested, folder, tables)
    records, failure = _play_all(player, report)
    if not records:
        raise RunError(f"{failure}; nothing was recorded")
    make_room()
    path = write_dataset(
        folder,
        name=scenario.scenario.title if not failure else f"{scenario.scenario.title} (INCOMPLETE: {failure})",
        plant=scenario.scenario.plant,
        identity=driver.identity,
        records=records,
        units={channel.name: channel.unit for channel in _channels(scenario)},
        holds={channel.name: "zero" for channel in scenario.profile.commands},
        incomplete=failure,
        metadata={"driver": scenario.driver.kind, "clock": scenario.clock.mode},
    )
    if failure:
        raise RunError(f"{failure}; the {len(records)} records before it are in {path}")
    return path


class _Player(NamedTuple):
    """What plays the excitations of a scenario."""

    scenario: Scenario
    driver: Driver
    stop_requested: Callable[[], bool]
    folder: Path
    tables: Mapping[str, Any] | None

    @property
    def safe_levels(self) -> tuple[float, ...]:
        """Level of each command that the driver is closed with [its unit]."""
        tables = self.scenario.limits.commands(self.scenario.profile)
        return tuple(one.safe_level for one in tables)

    def play(self, own: Scenario, levels: FloatArray, first: Measurement, title: str) -> OpenLoopRun:
        """Play `levels` (n,) on the open driver after a sample at rest; `own` has the period of this excitation."""
        rest = np.concatenate(([_rest(self.scenario)], levels))
        if self.tables is None:
            return play(own, self.driver, rest, first, self.stop_requested)
        with excitation_under_way(self.folder, own, self.tables, title) as place:
            return play(own, self.driver, rest, first, self.stop_requested, place.folder, place.changes)


def _play_all(player: _Player, report: Callable[[str], None]) -> tuple[list[Record], str]:
    """Play every excitation; return the records that are complete, and what ended the others ("": nothing)."""
    scenario = player.scenario
    records: list[Record] = []
    for index, levels in enumerate(command_sequences(scenario)):
        kind, own = scenario.excitation[index].kind, scenario.at_period_of(index)
        try:
            first = open_driver(player.driver, own)
        except RtctlError as error:
            if not records:
                raise
            return records, str(error)
        with closed_on_error(player.driver, player.safe_levels):
            report(f"{kind}: {len(levels) * own.scenario.period_s:.3g} s, {len(levels)} samples")
            if index == 0 and player.tables is not None:
                report(watch_words(player.folder))
            run = player.play(own, levels, first, f"{scenario.scenario.title}: {kind}")
        if run.outcome.fault is not None:
            return records, f"{run.outcome.fault}: {run.outcome.message}"
        if clamped := _clamped(run.signals, kind, scenario.profile.commands[0]):
            return records, clamped
        records.append(_record(run.signals, own, index, kind))
    return records, ""


def _rest(scenario: Scenario) -> float:
    """Return the level before a record: the lowest of a current, the safe one of a signed drive."""
    return scenario.limits.safe_level if scenario.profile.commands[0].signed else scenario.limits.low


def _channels(scenario: Scenario) -> list[Channel]:
    """Return the channels of the profile that a dataset of this kind of plant has."""
    profile, kind = scenario.profile, plant_kind(scenario.scenario.plant)
    if kind.free_signals:
        measured_twice = profile.reference.name in {f"reference_{one.name}" for one in profile.sensed}
        return list(profile.channels[:-1] if measured_twice else profile.channels)
    return [channel for channel in profile.channels if channel.name in kind.signals]


def _clamped(signals: Mapping[str, FloatArray], kind: str, command: Channel) -> str:
    """Return why a record must not be kept: commanded levels were never applied; "" if all were."""
    clamped = (signals["device_status"].astype(np.int64) & int(DeviceStatus.CLAMPED)) != 0
    if not clamped.any():
        return ""
    asked = signals[command.name][clamped]
    return (
        f"{kind}: the device clamped {int(clamped.sum())} commands between {asked.min():.4g} and "
        f"{asked.max():.4g} {command.unit} to its own limits; narrow --set limits.low=... and limits.high=... to them"
    )


def _name(index: int, kind: str) -> str:
    """Return the name of the record of an excitation."""
    return f"r{index:02d}-{kind}"


def _record(signals: Mapping[str, FloatArray], scenario: Scenario, index: int, kind: str) -> Record:
    excitation, profile = scenario.excitation[index], scenario.profile
    held = {channel.name: signals[channel.name] for channel in profile.commands}
    measured = {channel.name: signals[channel.name] for channel in (*profile.sensed, profile.reference)}
    if scenario.clock.mode == "lockstep":
        held = {name: np.append(levels[1:], levels[-1]) for name, levels in held.items()}
    held, measured = _fill_missed(signals["index"], held, measured)
    if not np.isfinite(measured[profile.reference.name]).all():
        measured.pop(profile.reference.name)  # no external instrument here
    kept = {channel.name for channel in _channels(scenario)}
    measured = {name: values for name, values in measured.items() if name in kept}
    return Record(
        name=_name(index, kind),
        period_s=scenario.scenario.period_s,
        use=excitation.use,
        signals={**held, **measured},
        conditions={"excitation": kind},
    )


def _fill_missed(
    index: FloatArray, held: Mapping[str, FloatArray], measured: Mapping[str, FloatArray]
) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Fill periods that a live run missed: commands were held, readings are interpolated."""
    whole = np.arange(int(index[-1]) + 1, dtype=np.float64)
    if len(whole) == len(index):
        return dict(held), dict(measured)
    last = np.searchsorted(index, whole, side="right") - 1
    return (
        {name: levels[last] for name, levels in held.items()},
        {name: np.interp(whole, index, values) for name, values in measured.items()},
    )
