"""Whether readings come later than a heating of first order has them: a delay or a lag that the model does not have.

One missing sample goes into the time constant (2.5 ms for 1.5 ms at 1 kHz), the loop is tuned by it, and swings.
"""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.identification.vo2.heating import ReadOut, estimate_reading_instant, shows_heating
from rtctl.measured.dataset import Record

LATE_ROWS = 0.25
LATE_ERRORS = 4.0
"""Rows by which readings are late, by one linear step for that and for the time constant together, and its standard
errors, above which a user has to know. A device that reads a row late gave 1.01 with its staircases, 0.53 without (the
step starts at a time constant that has taken up the rest); three that do not gave 0.005 at most."""
LATE = (
    "the readings follow the current later than a heating with one time constant, by about {late_ms:.2g} ms: a "
    "delay, a lag or a second time constant that this model does not have. A loop tuned by it may swing: run rtctl "
    "diagnose, and use the model that it extends"
)


def find_late_rows(
    records: Sequence[Record], resistance: ReadOut, deflection: ReadOut | None, time_constant_s: float
) -> float:
    """Return by how many rows readings are late, as far as that is certain; 0 where it is not.

    Args:
        records: Records with transients that show the time constant.
        resistance: Read-out of -ln R.
        deflection: Read-out of the deflection, where there is one.
        time_constant_s: Identified time constant [s].
    """
    if not any(one.period_s < 2.0 * time_constant_s and shows_heating(one) for one in records):
        return 0.0
    rows, error = estimate_reading_instant(records, resistance, deflection, time_constant_s, time_constant_s)
    return -rows if -rows > max(LATE_ROWS, LATE_ERRORS * error) else 0.0
