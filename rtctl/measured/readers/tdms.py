"""TDMS of LabVIEW and DIAdem by npTDMS: channels; piece by piece as the file stores them.

A column is named by its channel, or "group/channel" where several groups have a channel of that name. The
property `unit_string` is its unit, `wf_increment` its period [s], `wf_start_time` + `wf_start_offset` [s] the time of
its first sample. npTDMS gives raw counts where it does not know a scale, so such channels are refused here.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from nptdms import TdmsChannel, TdmsFile

from rtctl.measured.readers.groups import Place
from rtctl.measured.readers.stated.attributes import stated_decimation, stated_unit, texts_of, unapplied
from rtctl.measured.readers.stated.beside import plain
from rtctl.measured.readers.stated.rate import stated_period
from rtctl.measured.readers.table import Column, Header, Table, reading
from rtctl.measured.readers.tdms_segments import first_rows, whole_segments

_SCALE_TYPE = re.compile(r"NI_Scale\[\d+\]_Scale_Type")
_SCALES = frozenset(
    {
        "Polynomial",
        "Linear",
        "RTD",
        "Strain",
        "Table",
        "Thermistor",
        "Thermocouple",
        "Add",
        "Subtract",
        "AdvancedAPI",
    }
)
"""Scales that npTDMS applies (1.13)."""
_START = "wf_start_time, wf_start_offset"


def read(path: Path) -> Table:
    """Return the channels of a TDMS file as columns. Raises ValueError in words."""
    segments = whole_segments(path)
    with reading("a TDMS file"), path.open("rb") as file, TdmsFile.open(file) as opened:
        channels = [channel for group in opened.groups() for channel in group.channels()]
        places = {name: (c.group_name, c.name) for name, c in zip(_names(channels), channels, strict=True)}
        headers = {
            name: _header(c, (c.properties, opened[c.group_name].properties, opened.properties))
            for name, c in zip(_names(channels), channels, strict=True)
        }
        texts, beside = texts_of(opened.properties), {"": _beside(opened.properties)}
        beside |= {group.name: _beside(group.properties) for group in opened.groups()}
        for part in (*opened.groups(), *channels):
            texts |= texts_of(part.properties, part.name)
    with path.open("rb") as file:
        begun = first_rows(file, segments)
    starts = _starts(channels)
    for name, channel in zip(_names(channels), channels, strict=True):
        if channel.path in starts:
            headers[name] = headers[name]._replace(start_s=starts[channel.path], start_key=_START)
        headers[name] = headers[name]._replace(begun=begun.get(channel.path, ()))

    def load(name: str, first: int, end: int) -> Column:
        # opened as a file, so that an index file beside it, which may be old, is not believed
        with reading("a TDMS file"), path.open("rb") as file, TdmsFile.open(file) as opened:
            group, channel = places[name]
            return np.asarray(opened[group][channel].read_data(first, end - first))

    inside = {name: Place(f"{group}/{channel}", (group,)) for name, (group, channel) in places.items()}
    return Table(columns=headers, load=load, places=inside, texts=texts, beside=beside)


def _names(channels: list[TdmsChannel]) -> list[str]:
    counts = Counter(channel.name for channel in channels)
    return [c.name if counts[c.name] == 1 else f"{c.group_name}/{c.name}" for c in channels]


def _starts(channels: list[TdmsChannel]) -> dict[str, float]:
    """Return the start [s] of each waveform by its path; their start times count where all of them have one."""
    waveforms = {
        channel.path: channel.properties
        for channel in channels
        if _number(channel.properties.get("wf_increment")) > 0.0 and _in_seconds(channel.properties)
    }
    offsets_s = {path: _number(properties.get("wf_start_offset")) for path, properties in waveforms.items()}
    times = {path: properties.get("wf_start_time") for path, properties in waveforms.items()}
    dated = [time for time in times.values() if isinstance(time, np.datetime64)]
    if len(dated) < len(times) or not dated:
        return offsets_s
    return {
        path: offsets_s[path] + float((time - min(dated)) / np.timedelta64(1, "us")) * 1e-6
        for path, time in times.items()
    }


def _header(channel: TdmsChannel, levels: tuple[Mapping[str, Any], ...]) -> Header:
    """Return the header of a channel; `levels` are the properties of channel, group and file, as scales are sought."""
    properties = channel.properties
    increment_s = _number(properties.get("wf_increment"))
    if increment_s > 0.0 and _in_seconds(properties):
        period: tuple[float | None, str] = increment_s, "wf_increment"
    else:
        period = stated_period(*levels) or (None, "")
    refusal = _unknown_scale(levels)
    dtype = np.dtype(np.float64) if refusal else channel.dtype  # npTDMS would log an unknown scale
    return Header(
        shape=(len(channel),),
        dtype=None if dtype.hasobject else dtype,
        unit=stated_unit(properties),
        period_s=period[0],
        period_key=period[1],
        unapplied=unapplied(properties),
        decimation=stated_decimation(properties),
        refusal="holds text, numbers are needed" if dtype.hasobject else refusal,
    )


def _beside(properties: Mapping[str, Any]) -> dict[str, Any]:
    return {key: kept for key, value in properties.items() if (kept := plain(value)) is not None}


def _unknown_scale(levels: tuple[Mapping[str, Any], ...]) -> str:
    """Return why the scale of a channel cannot be applied, as a phrase that continues its name; "": it can."""
    for properties in levels:
        kinds = {key: str(value) for key, value in properties.items() if _SCALE_TYPE.fullmatch(key)}
        if not kinds or properties.get("NI_Number_Of_Scales") == 0:
            continue
        if properties.get("NI_Scaling_Status") == "scaled":
            return ""
        unknown = sorted(set(kinds.values()) - _SCALES)
        if unknown:
            return (
                f'is stored as counts with a scale that is not known, "{unknown[0]}" (known: '
                f"{', '.join(sorted(_SCALES))}); save it scaled from LabVIEW or DIAdem"
            )
        return ""
    return ""


def _in_seconds(properties: Mapping[str, Any]) -> bool:
    return str(properties.get("wf_xunit_string", "s")).strip().lower() in ("", "s", "sec", "seconds", "time")


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float | np.number) else 0.0
