"""What a compiled block of steps goes on from and leaves behind: one record of numbers; and why a block has ended.

Times are of the monotonic clock [ns]; levels and readings in the units of the profile.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

MOST_DELAY = 4
NOTHING, PI = 0, 1
"""What decides: a playback of levels without an estimate, or the observer under a PI."""

_I, _F = np.int64, np.float64
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
        ("low", _F), ("high", _F), ("slew", _F), ("fit_error", _F),
        ("rms_squared", _F), ("rms_window_s", _F), ("mean_square", _F),
        # what is believed of a reading
        ("sensed_low", _F), ("sensed_high", _F), ("guarded", _I), ("timed", _I), ("rate", _F),
        ("frozen_after", _I), ("frozen_travel", _F), ("lockstep_us", _I), ("tolerance_us", _F),
        # the readings before
        ("sensed", _F), ("counter", _I), ("time_us", _I), ("reference", _F), ("status", _I), ("in_force", _I),
        ("equal", _I), ("lowest", _F), ("highest", _F), ("counts", _I),
        ("anchored", _I), ("anchor_us", _I), ("anchor_begun_ns", _I), ("anchor_answered_ns", _I),
        # of the sample that a block has ended in
        ("missed", _I), ("begun_ns", _I), ("answered_ns", _I), ("ended", _I),
        # counted
        ("steps", _I), ("overruns", _I), ("rows", _I), ("signal_number", _I), ("timing_number", _I),
    ]
)  # fmt: skip

Record = Any
"""A row of `LOOP` inside a kernel: numba knows its type, mypy does not."""
Loop = NDArray[Any]
"""(1,) of `LOOP`."""


class BlockExit(IntEnum):
    """Why a block has ended; in all but the first three Python completes the sample that is under way."""

    DONE = 0
    """All rows are written, or the last sample is taken."""
    SIGNAL = 1
    """A signal came: Python's handlers want to run. No sample is under way."""
    LATE = 2
    """The plan's last samples went by; they are counted."""
    MISSED = 3
    """Periods were missed and somebody judges them, or the level in force is too much for so long: not sent yet."""
    EXCHANGE = 4
    """The exchange did not end well."""
    UNLIKELY = 5
    """The reading is not to be believed."""
    CHANGE = 6
    """A parameter is to be changed; the reading is judged, nothing is decided."""
    NOT_FINITE = 7
    """The controller asked for what is no level; its terms and the estimate are not recorded."""
    ENERGY = 8
    """The next level would put in too much."""


DONE, SIGNAL, LATE, MISSED, EXCHANGE, UNLIKELY, CHANGE, NOT_FINITE, ENERGY = (int(code) for code in BlockExit)
