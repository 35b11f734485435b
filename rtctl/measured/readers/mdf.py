"""Measurement data files (ASAM MDF 3 and 4, dSPACE, CANape, INCA) by asammdf: channels, converted as the file says.

A column is a channel, or `group/channel` where several channel groups have one of that name (groups from 0). The
time of a group is its master channel: `time`, or `group/time` where several groups have samples.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.extras import require
from rtctl.measured.readers.groups import Place
from rtctl.measured.readers.table import Column, Header, Table, reading

TIME = "time"


class _Place(NamedTuple):
    """Place of a channel in the file."""

    group: int
    channel: int
    is_time: bool


def read(path: Path) -> Table:
    """Return the channels of a file as columns. Raises ValueError in words."""
    mdf: Any = require("asammdf", "reading .mf4").MDF
    headers: dict[str, Header] = {}
    with reading("a measurement data file (MDF)"), mdf(path) as file:
        places = _places(file)
        for name, place in places.items():
            headers[name] = _header(file, place)

    def load(name: str, first: int, end: int) -> Column:
        with reading("a measurement data file (MDF)"), mdf(path) as file:
            return np.asarray(_samples(file, places[name]))[first:end]

    inside = {
        name: Place(name if name.startswith(f"{one.group}/") else f"{one.group}/{name}", (str(one.group),))
        for name, one in places.items()
    }
    return Table(columns=headers, load=load, piecewise=False, places=inside)


def _places(file: Any) -> dict[str, _Place]:
    masters = dict(file.masters_db)
    channels = [
        _Place(g, k, k == masters.get(g))
        for g, group in enumerate(file.groups)
        if group.channel_group.cycles_nr
        for k in range(len(group.channels))
    ]
    names = [
        TIME if one.is_time else str(file.groups[one.group].channels[one.channel].name) for one in channels
    ]
    counts = Counter(names)
    return {
        name if counts[name] == 1 else f"{one.group}/{name}": one
        for name, one in zip(names, channels, strict=True)
    }


def _header(file: Any, place: _Place) -> Header:
    cycles = int(file.groups[place.group].channel_group.cycles_nr)
    if place.is_time:
        return Header(shape=(cycles,), dtype=np.dtype(np.float64), unit="s")
    signal = file.get(group=place.group, index=place.channel, record_offset=0, record_count=1)
    samples = np.asarray(signal.samples)
    text = samples.dtype.kind in "SUOV"
    return Header(
        shape=(cycles, *samples.shape[1:]),
        dtype=None if text else samples.dtype,
        unit=str(signal.unit).strip() or None,
        refusal="holds text or structures, numbers are needed" if text else "",
    )


def _samples(file: Any, place: _Place) -> Any:
    """Return the readings of a channel; NaN where the file marks them as invalid."""
    if place.is_time:
        return file.get_master(place.group)
    signal = file.get(group=place.group, index=place.channel, ignore_invalidation_bits=True)
    invalid = signal.invalidation_bits
    if invalid is None or not np.any(invalid):
        return signal.samples
    readings = signal.samples.astype(np.float64)
    readings[np.asarray(invalid, dtype=bool)] = np.nan
    return readings
