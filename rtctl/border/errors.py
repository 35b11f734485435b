"""Exceptions that are raised on purpose: bad input (exit 2) and a run that failed (exit 1)."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from enum import StrEnum
from os import PathLike


class RtctlError(Exception):
    """Base of every error that a user reads: one message, no traceback."""

    exit_code = 1


class InputError(RtctlError):
    """A file, a key, a unit or an option is wrong, found before anything moves. Exit code 2."""

    exit_code = 2


class NoStreamError(InputError):
    """A model cannot be a device that runs sample by sample: `mechanisms` have no form for one."""

    def __init__(self, message: str, mechanisms: tuple[str, ...]) -> None:
        super().__init__(message)
        self.mechanisms = mechanisms


class RunError(RtctlError):
    """A run started and failed. Exit code 1."""


class Fault(StrEnum):
    """Reason for which a loop ended early."""

    NO_ANSWER = "no_answer"
    STALE_REPLY = "stale_reply"
    COMMAND_REFUSED = "command_refused"
    WATCHDOG_TRIPPED = "watchdog_tripped"
    SENSOR_FAULT = "sensor_fault"
    NOT_ENABLED = "not_enabled"
    NOT_FINITE = "not_finite"
    OUT_OF_RANGE = "out_of_range"
    RATE = "rate"
    FROZEN_VALUE = "frozen_value"
    FROZEN_COUNTER = "frozen_counter"
    COUNTER_JUMP = "counter_jump"
    DEVICE_TIME = "device_time"
    LEVEL_LIMIT = "level_limit"
    SLEW_LIMIT = "slew_limit"
    ENERGY_LIMIT = "energy_limit"
    COMPLIANCE = "compliance"
    CONNECTION_LOST = "connection_lost"
    DEADLINES_MISSED = "deadlines_missed"
    RECORDING = "recording"
    PART_FAILED = "part_failed"
    """An estimator or controller of the user raised, or returned what is none."""
    KILLED = "killed"
    INTERRUPTED = "interrupted"


class DriverError(RunError):
    """The wire or the device failed during a run; `fault` names how."""

    def __init__(self, fault: Fault, message: str) -> None:
        super().__init__(message)
        self.fault = fault


def check_utf8(path: object) -> None:
    """Raise InputError for the name of a file or folder that is no UTF-8: no manifest, Parquet file or report holds it.

    Python has such bytes as surrogates (PEP 383).
    """
    text = str(path) if isinstance(path, str | PathLike) else ""
    try:
        text.encode()
    except UnicodeEncodeError:
        shown = text.encode("utf-8", "backslashreplace").decode()
        raise InputError(f"{shown}: the name is not UTF-8; rename it, or choose another") from None


def nearest(word: str, known: Iterable[str], *, listed: bool = False) -> str:
    """Return `; did you mean "x"?` or the list of known words, to end a message about a misspelt word.

    `listed`: the message has the list already.
    """
    names = sorted(known)
    close = difflib.get_close_matches(word, names, n=1, cutoff=0.5)
    if close:
        return f'; did you mean "{close[0]}"?'
    return f"; known: {', '.join(names)}" if names and not listed else ""
