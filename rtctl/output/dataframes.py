"""Signals as a table of pandas, for notebooks; pandas is imported when one is made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rtctl.extras import require

if TYPE_CHECKING:
    import pandas as pd


def data_frame(
    columns: Mapping[str, Any], index: Any, index_name: str, units: Mapping[str, str] | None, purpose: str
) -> pd.DataFrame:
    """Return columns (n,) of one index (n,) as a table, with their units in `attrs["units"]`.

    Args:
        columns: Arrays by name.
        index: What tells the rows apart, such as their times.
        index_name: Its name, with its unit: "time_s".
        units: Unit of each column, by its name; None: not known here.
        purpose: What needs pandas, such as "Run.to_dataframe"; a message begins with it.

    Raises:
        InputError: pandas is not installed; the message names the extra that installs it.
    """
    pandas: Any = require("pandas", purpose)
    frame: pd.DataFrame = pandas.DataFrame(dict(columns), index=pandas.Index(index, name=index_name))
    frame.attrs["units"] = {name: units[name] for name in columns if name in units} if units else {}
    return frame


def stacked(frames: Mapping[str, pd.DataFrame], level: str) -> pd.DataFrame:
    """Return tables one below the other, their names as a first `level` of the index; units are those of all."""
    pandas: Any = require("pandas", "stacking tables")
    first = next(iter(frames.values()))
    table: pd.DataFrame = pandas.concat(dict(frames), names=[level, first.index.name])
    table.attrs["units"] = {
        name: unit for one in frames.values() for name, unit in one.attrs["units"].items()
    }
    return table
