"""Excitations through a driver into a dataset: so identification works on whatever is at the end of the wire.

The loop plays them; here its rows become rows of a dataset. In lockstep a reading is from the end of the period of
its own command, so the outputs move down by one row; live it is from before the command, as a dataset has it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rtctl.border.errors import InputError, RtctlError, RunError
from rtctl.border.records import DeviceStatus, Driver
from rtctl.measured.dataset import Record
from rtctl.measured.writer import write_dataset
from rtctl.scenario import Scenario
from rtctl.session import currents_of, open_driver, play

FloatArray = NDArray[np.float64]


def acquire(
    scenario: Scenario,
    driver: Driver,
    folder: Path,
    stop_requested: Callable[[], bool],
    report: Callable[[str], None],
) -> Path:
    """Play every excitation, write the dataset, return its manifest's path. Raises RunError on a fault.

    Records that were complete before a fault are written all the same, and the message says so.
    """
    if not scenario.excitation:
        raise InputError("the scenario has no [[excitation]] table: nothing to play")
    records: list[Record] = []
    failure = ""
    for index, currents in enumerate(currents_of(scenario)):
        kind = scenario.excitation[index].kind
        report(f"{kind}: {len(currents) * scenario.scenario.period_s:.3g} s, {len(currents)} samples")
        try:
            first = open_driver(driver, scenario)
        except RtctlError as error:
            if not records:
                raise
            failure = str(error)
            break
        rest = np.concatenate(([scenario.limits.low], currents))
        signals, outcome = play(scenario, driver, rest, first, stop_requested)
        if outcome.fault is not None:
            failure = f"{outcome.fault}: {outcome.message}"
            break
        if failure := _clamped(signals, kind):
            break
        records.append(_record(signals, scenario, index, kind))
    if not records:
        raise RunError(f"{failure}; nothing was recorded")
    path = write_dataset(
        folder,
        name=scenario.scenario.title if not failure else f"{scenario.scenario.title} (INCOMPLETE: {failure})",
        plant=scenario.scenario.plant,
        identity=driver.identity,
        records=records,
        metadata={"program": "rtctl", "driver": scenario.driver.kind, "clock": scenario.clock.mode},
    )
    if failure:
        raise RunError(f"{failure}; the {len(records)} records before it are in {path}")
    return path


def _clamped(signals: Mapping[str, FloatArray], kind: str) -> str:
    """Why a record must not be kept: it would hold commanded currents that were never applied. Empty: none."""
    clamped = (signals["device_status"].astype(np.int64) & int(DeviceStatus.CLAMPED)) != 0
    if not clamped.any():
        return ""
    asked = signals["current"][clamped]
    return (
        f"{kind}: the device clamped {int(clamped.sum())} commands between {asked.min():.4g} and "
        f"{asked.max():.4g} mA to its own limits; narrow --set limits.low=... and limits.high=... to them"
    )


def _record(signals: Mapping[str, FloatArray], scenario: Scenario, index: int, kind: str) -> Record:
    excitation = scenario.excitation[index]
    shift = 1 if scenario.clock.mode == "lockstep" else 0
    current, outputs = signals["current"], {name: signals[name] for name in ("resistance", "deflection")}
    if shift:
        current = np.append(current[1:], current[-1])
    current, outputs = _fill_missed(signals["index"], current, outputs)
    if not np.isfinite(outputs["deflection"]).all():
        outputs.pop("deflection")  # no external instrument here
    return Record(
        name=f"r{index:02d}-{kind}",
        period_s=scenario.scenario.period_s,
        use=excitation.use,
        signals={"current": current, **outputs},
        conditions={"excitation": kind},
    )


def _fill_missed(
    index: FloatArray, current: FloatArray, outputs: Mapping[str, FloatArray]
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Periods that a live run missed: the device went on holding its current, the readings are interpolated."""
    whole = np.arange(int(index[-1]) + 1, dtype=np.float64)
    if len(whole) == len(index):
        return current, dict(outputs)
    held = current[np.searchsorted(index, whole, side="right") - 1]
    return held, {name: np.interp(whole, index, values) for name, values in outputs.items()}
