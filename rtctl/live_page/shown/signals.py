"""The signals that the page draws of a recording: recorded ones, errors and the estimate's band, in one matrix.

tracking error = setpoint − output, self-sensing error = estimate − output, band = estimate ± 2 standard errors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import plain_unit
from rtctl.border.records import DeviceProfile
from rtctl.controllers.playback import PlaybackController
from rtctl.live_page.recorded.rows import INDEX
from rtctl.output.readable_units import printed_unit
from rtctl.scenario.schema import Scenario

PLAYED_TERMS = {name for name, _ in PlaybackController().terms}
"""Terms of a command that is played: there is no controller, so two are 0 and one is the command."""
NOT_DRAWN = {INDEX, "counter", "device_time", "device_status", "estimate_status"}
"""Counters and bits, which are no signals."""
ROW_BEGIN = ("setpoint", "estimate")
"""First signals of a loop's row; behind the estimate come its surrogate and its standard error."""
BAND_ERRORS = 2.0
"""Half height of the band around an estimate [standard errors]."""


class Signal(NamedTuple):
    """One signal of the page."""

    name: str
    unit: str
    """As it is printed."""
    role: str
    """setpoint | measured | estimate | band | error | sensing_error | command | reading | surrogate | term | signal."""


class ShownSignals(NamedTuple):
    """The signals of the page, and how they come from the columns of a recording."""

    signals: tuple[Signal, ...]
    output: str
    """Name of the controlled output; "": there is none."""

    def matrix(self, table: Mapping[str, FloatArray]) -> FloatArray:
        """Return the signals (signals, rows) from the columns (rows,) of a recording."""
        return np.stack([self._values(signal, table) for signal in self.signals])

    def _values(self, signal: Signal, table: Mapping[str, FloatArray]) -> FloatArray:
        if signal.role in ("error", "sensing_error"):
            output, estimate = table[self.output], table["estimate"]
            if signal.role == "sensing_error":
                return estimate - output
            return table["setpoint"] - np.where(np.isfinite(output), output, estimate)
        if signal.role == "band":
            sign = -1.0 if signal.name == BAND_NAMES[0] else 1.0
            return table["estimate"] + sign * BAND_ERRORS * table["estimate_standard_error"]
        return table[signal.name]


BAND_NAMES = ("estimate − 2 standard errors", "estimate + 2 standard errors")


def signals_of(columns: Sequence[tuple[str, str]], scenario: Scenario | None) -> ShownSignals:
    """Return the signals of a recording.

    Args:
        columns: names and units of its columns.
        scenario: the scenario that was recorded; None: not known, or no loop recorded it.
    """
    units = {name: printed_unit(plain_unit(unit)) for name, unit in columns}
    if scenario is None or not set(ROW_BEGIN) <= units.keys():
        plain = (Signal(name, unit, "signal") for name, unit in units.items() if name not in NOT_DRAWN)
        return ShownSignals(tuple(plain), "")
    profile, unit = scenario.profile, units[scenario.profile.reference.name]
    loop = [Signal(profile.reference.name, unit, "measured"), Signal("estimate", unit, "estimate")]
    loop += [Signal(name, unit, "band") for name in BAND_NAMES]
    loop += [Signal("self-sensing error", unit, "sensing_error")]
    known = {"setpoint", "estimate", "estimate_standard_error", profile.reference.name} | NOT_DRAWN
    if scenario.reference is None:  # the column of the set-point holds commands that were played
        known |= PLAYED_TERMS
    else:
        loop = [Signal("setpoint", unit, "setpoint"), *loop, Signal("tracking error", unit, "error")]
    others = (
        Signal(name, unit, _role(name, profile, list(units)))
        for name, unit in units.items()
        if name not in known
    )
    return ShownSignals((*loop, *others), profile.reference.name)


def _role(name: str, profile: DeviceProfile, names: Sequence[str]) -> str:
    if name in {channel.name for channel in profile.commands}:
        return "command"
    if name in {channel.name for channel in profile.sensed}:
        return "reading"
    return "surrogate" if name == names[names.index("estimate") + 1] else "term"
