"""Columns of one file that do not begin at the same time: how many rows each begins before the latest of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from rtctl.measured.readers.table import Header


class Begun(Protocol):
    """What states when a column begins: its header, or what was surveyed of it."""

    @property
    def start_s(self) -> float | None:
        """Time [s] of the first sample, from an origin that the columns share."""

    @property
    def start_key(self) -> str:
        """Key under which the file states it."""


SAME = 0.01
"""Difference of two starts, in periods, below which they are the same instant."""


def leading_rows(headers: Mapping[str, Begun], period_s: float) -> dict[str, int]:
    """Return the rows of each column before the instant at which the last of them begins.

    Args:
        headers: Headers by column; those that state no start are taken to begin with the latest.
        period_s: Sample period [s].

    Raises:
        ValueError: Starts differ by a part of a period.
    """
    starts = {name: one.start_s for name, one in headers.items() if one.start_s is not None}
    latest = max(starts.values(), default=0.0)
    leads = dict.fromkeys(headers, 0)
    for name, start_s in starts.items():
        periods = (latest - start_s) / period_s
        if abs(periods - round(periods)) > SAME:
            key = headers[name].start_key
            raise ValueError(
                f'column "{name}" begins {periods:.4g} sample periods before the latest of the columns ({key}): not a '
                "whole number of them; resample the columns to common instants"
            )
        leads[name] = round(periods)
    return leads


def describe_leads(leads: Mapping[str, int], headers: Mapping[str, Begun]) -> str:
    """Return what was left out to align the columns; "": nothing was."""
    early = {name: lead for name, lead in leads.items() if lead}
    if not early:
        return ""
    keys = ", ".join(sorted({headers[name].start_key for name in early}))
    counts = ", ".join(f'{lead} of "{name}"' for name, lead in early.items())
    return (
        f"the columns begin at different times ({keys}): the first samples are left out, {counts}; rows are counted "
        "from the first instant that all have"
    )


def check_one_acquisition(headers: Mapping[str, Header], rows: tuple[int, int] | None) -> None:
    """Raise ValueError where the rows [first, end) of a record (None: all) go across the pause between acquisitions."""
    for name, header in headers.items():
        inside = [row for row in header.begun if rows is None or rows[0] < row < rows[1]]
        if inside:
            edges = [0, *header.begun, max(header.shape)]
            parts = ", ".join(f"rows = [{a}, {b}]" for a, b in zip(edges[:-1], edges[1:], strict=True))
            raise ValueError(
                f'column "{name}" holds {len(edges) - 1} acquisitions, with a pause before row {inside[0]} (the file '
                f"states a start time of each): make a record of each, {parts}"
            )
