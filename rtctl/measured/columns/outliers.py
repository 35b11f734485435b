"""Readings far from all others: a code for no reading, or a single misread one."""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.measured.columns.conversion import rows_text

FAR = 15.0
"""Distance from the median over the interquartile range from which a reading is far from all others. A motion reaches
one or two; the peaks of impacts are farther, but of many sizes."""
MOST_CODES = 2
"""Different numbers at most that are codes: one, or one of each sign."""
MOST_SINGLE = 2
"""Readings up to which they are single ones, of any size."""
MOST_SHARE = 0.25
"""Largest share of the readings that codes make up."""


def describe_far_readings(
    values: FloatArray, column: str, unit: str, first_row: int, *, is_input: bool
) -> str:
    """Return a remark on readings (n,) far from all others that are single, or equal each other; "": there are none.

    Args:
        values: Finite readings.
        column: Name of the column.
        unit: Unit of the readings, as the remark writes it.
        first_row: Row of the file of the first reading.
        is_input: Whether they are those of an input, of which many equal ones are pulses.
    """
    low, middle, high = np.quantile(values, (0.25, 0.5, 0.75))
    if not high > low:
        return ""
    far = np.flatnonzero(np.abs(values - middle) > FAR * (high - low))
    if not 0 < len(far) <= MOST_SHARE * len(values):
        return ""
    sizes = np.unique(values[far])
    if len(far) > MOST_SINGLE and (is_input or len(sizes) > MOST_CODES):
        return ""
    if len(far) <= MOST_SINGLE and (far[0] < MOST_SINGLE or far[-1] >= len(values) - MOST_SINGLE):
        return ""  # a warm-up begins, a cooling ends so
    others = np.delete(values, far)
    what = " and ".join(f"{size:.6g}" for size in sizes)
    count = "1 reading is" if len(far) == 1 else f"{len(far)} readings are"
    return (
        f'column "{column}": {count} {what} {unit}, far from all others ({others.min():.4g} to {others.max():.4g}), '
        f"{rows_text(far + first_row)}. If this stands for no reading, empty these cells and make the manifest again "
        "(rtctl init leaves the rows out), or leave them out with rows = [first, end]"
    )
