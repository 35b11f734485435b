"""Shared state of a compiled block, one record of numbers, and its exit reasons.

Times are of the monotonic clock [ns]; levels and readings in the units of the profile.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtctl.safety.guards import GUARD

MOST_DELAY = 4
NOTHING, PI = 0, 1
"""What decides on the next level: a playback of levels without an estimate, or the observer and the PI."""

_I, _F = np.int64, np.float64
GUARD_FIELDS = list(GUARD.names or ())
LOOP = np.dtype(
    [
        # clock
        ("live", _I), ("period_ns", _I), ("start_ns", _I), ("most_behind", _I), ("tick", _I), ("next_tick", _I),
        ("spins", _I), ("spin_ns", _F), ("spin_most_ns", _F), ("spin_longer_ns", _F), ("spin_shorter_ns", _F),
        ("lateness_ns", _I), ("judges_missed", _I),
        # plan
        ("period_s", _F), ("first", _I), ("last", _I), ("index", _I), ("setpoint", _F),
        # command
        ("decides", _I), ("level", _F), ("delay", _I), ("sent", _F, (MOST_DELAY + 1,)),
        ("low", _F), ("high", _F), ("slew", _F), ("fit_error", _F), ("reading_error", _F),
        ("rms_squared", _F), ("rms_window_s", _F), ("mean_square", _F),
        # plausible readings
        ("sensed_low", _F), ("sensed_high", _F), ("guarded", _I), ("rate", _F),
        # the reading before
        ("sensed", _F), ("counter", _I), ("time_us", _I), ("reference", _F), ("status", _I), ("in_force", _I),
        # of the sample that a block has ended in
        ("missed", _I), ("begun_ns", _I), ("answered_ns", _I), ("ended", _I),
        # counted
        ("steps", _I), ("overruns", _I), ("rows", _I), ("signal_number", _I), ("timing_number", _I),
        *((name, GUARD[name]) for name in GUARD_FIELDS),
    ]
)  # fmt: skip

Record = Any
"""A row of `LOOP` inside a kernel: numba knows its type, mypy does not."""
Loop = NDArray[Any]
"""(1,) of `LOOP`."""


class BlockExit(IntEnum):
    """Why a block ended; in all but the first three cases Python completes the sample under way."""

    DONE = 0
    """All rows are written, or the last sample was taken."""
    SIGNAL = 1
    """A signal came and Python's handler is to run; no sample is under way."""
    LATE = 2
    """The plan's last samples were missed; they are counted."""
    MISSED = 3
    """Periods were missed and are to be judged, or the level in force was held too long; nothing is sent yet."""
    EXCHANGE = 4
    """The exchange failed, or is one for Python."""
    UNLIKELY = 5
    """The reading is implausible."""
    CHANGE = 6
    """A parameter is to change; the reading is judged, nothing is decided yet."""
    NOT_FINITE = 7
    """The controller asked for a level that is not finite; the sample is not recorded."""
    ENERGY = 8
    """The next level would exceed the limit of the mean square."""
    CONTRADICTED = 9
    """The reading stays while the model's moves; the sample is not recorded."""


(DONE, SIGNAL, LATE, MISSED, EXCHANGE, UNLIKELY, CHANGE, NOT_FINITE, ENERGY, CONTRADICTED) = map(
    int, BlockExit
)
