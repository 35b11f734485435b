"""Exports of oscilloscopes, lock-ins and robots, whose numbers count something that stands beside them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from corpus_binary import made, mat
from corpus_case import MANIFEST, RIGHT, ROWS, Right, Situation, T, U, Write, X, refused, table, text

SIZES = {"Channel 1": (U, 1e-3, 0.5), "Channel 2": (X, float(np.abs(X).max()) / 20_000.0, -0.03)}
"""Signal of each channel, its increment and its origin."""
BY_STRUCT = {
    "inputs": "Channel_1.Data",
    "outputs": {"displacement": "Channel_2.Data"},
    "scales": "displacement=1 mm/V",
}
BY_GROUP = {
    "inputs": "Waveforms/Channel 1/Channel 1Data",
    "outputs": {"displacement": "Waveforms/Channel 2/Channel 2Data"},
    "scales": "displacement=1 mm/V",
}
ROUNDED = Right(remark="counts of a converter", within=1e-3)
"""The truth to a step of the converter."""


def counts(channel: str) -> np.ndarray:
    values, increment, origin = SIZES[channel]
    return np.round((values - origin) / increment).astype(np.int16)


def preamble(channel: str, **others: Any) -> dict[str, Any]:
    _, increment, origin = SIZES[channel]
    return {
        "XInc": 1e-3,
        "XOrg": -0.1,
        "XUnits": "Second",
        "YInc": increment,
        "YOrg": origin,
        "YUnits": "Volt",
    } | others


def structs(kind: type = np.int16, **others: Any) -> Write:
    """MATLAB file of Keysight: a struct a channel."""
    channels = {
        one.replace(" ", "_"): preamble(one, Data=counts(one).astype(kind)[:, None], **others)
        for one in SIZES
    }
    return mat(**channels)


def structs_of(keys: Mapping[str, str]) -> Write:
    """A struct a channel, with the words of another program."""
    channels = {
        one.replace(" ", "_"): {keys.get(key, key): value for key, value in preamble(one).items()}
        | {"Data": counts(one)}
        for one in SIZES
    }
    return mat(**channels)


def volts(path: Path) -> None:
    groups(path, lambda channel: SIZES[channel][0])


def groups(path: Path, stored: Any = counts) -> None:
    """HDF5 of Keysight: a group a channel, with its preamble as attributes."""
    with h5py.File(path, "w") as file:
        for channel in SIZES:
            group = file.create_group(f"Waveforms/{channel}")
            for key, value in preamble(channel, YDispRange=8.0, NumPoints=ROWS).items():
                group.attrs[key] = value
            group[f"{channel}Data"] = stored(channel)


def segments(path: Path) -> None:
    """HDF5 of Keysight with two segments in the group of each channel."""
    with h5py.File(path, "w") as file:
        for channel in SIZES:
            group = file.create_group(f"Waveforms/{channel}")
            group.attrs.update(preamble(channel, NumSegments=2))
            for k, half in enumerate(np.split(counts(channel), 2), 1):
                group[f"{channel} Seg{k}Data"] = half


BY_SEGMENT = {
    "inputs": "Waveforms/Channel 1/Channel 1 Seg1Data",
    "outputs": {"displacement": "Waveforms/Channel 2/Channel 2 Seg1Data"},
    "scales": "displacement=1 mm/V",
}
SCOPES = (
    Situation("Keysight, the first of two segments", made("r.h5", segments), ROUNDED._replace(fewest=300), BY_SEGMENT),
    Situation("Keysight, counts in structs", structs(), ROUNDED, BY_STRUCT),
    Situation("Keysight, counts in structs in floating point", structs(float), ROUNDED, BY_STRUCT),
    Situation("Keysight, volts in structs", mat(**{one.replace(" ", "_"): preamble(one, Data=values) for one, (values, _, _) in SIZES.items()}), Right(), BY_STRUCT),
    Situation("Keysight, counts in groups of HDF5", made("r.h5", groups), ROUNDED, BY_GROUP),
    Situation("Keysight, volts in groups of HDF5", made("r.h5", volts), Right(), BY_GROUP),
    Situation("Keysight, two channels in volts, nothing said", made("r.h5", groups), refused("r.h5", "which motion was measured", "Waveforms/Channel 2/Channel 2Data", "--output")),
    Situation("Keysight, counts, and a manifest in volts", structs(), ROUNDED._replace(units={"drive": "V", "displacement": "V"}), {"manifest": MANIFEST.replace('"mm"', '"V"').replace('"u"', '"Channel_1.Data"').replace('"x"', '"Channel_2.Data"')}),
    Situation("a preamble of SCPI", structs_of({"XInc": "XIncrement", "YInc": "YIncrement", "YOrg": "YOrigin"}), ROUNDED, BY_STRUCT),
    Situation("a preamble of Tektronix", structs_of({"XInc": "XINCR", "YInc": "YMULT", "YOrg": "YZERO"}), ROUNDED, BY_STRUCT),
    Situation("channels that begin a part of a sample apart", mat(Channel_1=preamble("Channel 1", Data=counts("Channel 1")), Channel_2=preamble("Channel 2", Data=counts("Channel 2"), XOrg=-0.1004)), refused("r.mat", "0.4 sample periods", "XOrg"), BY_STRUCT),
)  # fmt: skip
TICKS = 12_345_678_901 + np.round(60e6 * T).astype(np.uint64)
"""Timestamps of a lock-in: ticks of a clock of 60 MHz since it was switched on."""


def polled(*parts: slice, **others: Any) -> Write:
    """MATLAB file of Zurich Instruments: a cell of samples in the structs of device and demodulators."""
    samples = np.empty((1, len(parts)), dtype=object)
    for k, rows in enumerate(parts):
        columns = {"timestamp": TICKS, "x": U, "y": X, "frequency": np.full(ROWS, 1e5)}
        samples[0, k] = {name: values[rows][None, :] for name, values in columns.items()}
    return mat(dev1234={"demods": {"sample": samples}} | others)


def recorded(path: Path, **attributes: Any) -> None:
    """HDF5 of Zurich Instruments."""
    with h5py.File(path, "w") as file:
        group = file.create_group("000/dev1234/demods/0/sample")
        group.attrs.update(attributes)
        for name, values in (("timestamp", TICKS), ("x", U), ("y", X)):
            group[name] = values


def swept_in_rows() -> str:
    rows = [
        ("timestamp", [str(one) for one in TICKS]),
        ("x", [f"{one:.9g}" for one in U]),
        ("y", [f"{one:.9g}" for one in X]),
    ]
    lines = [
        "chunk;timestamp;size;fieldname",
        *(f"0;{TICKS[0]};{ROWS};{name};" + ";".join(cells) for name, cells in rows),
    ]
    return "\n".join(lines) + "\n"


SAMPLE = "dev1234.demods.sample{1}"
BY_CELL = {"inputs": f"{SAMPLE}.x:V", "outputs": {"displacement": f"{SAMPLE}.y:mm"}}
BY_PATH = {
    "inputs": "000/dev1234/demods/0/sample/x:V",
    "outputs": {"displacement": "000/dev1234/demods/0/sample/y:mm"},
}
ALL = slice(None)
COUNTED = "timestamp;x [V];y [mm]\n" + table([str(one) for one in TICKS], U, X, separator=";")
BY_NAME = {"inputs": "x [V]", "outputs": {"displacement": "y [mm]"}}
ASKED = (
    "nobody states the unit of the time column",
    "as ticks of a clock of 60 MHz 1000 Hz",
    "clockbase",
    "--time",
)
IN_TICKS = (
    MANIFEST.replace("sample_rate_hz = 1000.0", 'time = "timestamp"\ntime_unit = "UNIT"')
    .replace('"u"', '"x [V]"')
    .replace('column = "x"', 'column = "y [mm]"')
)
LOCK_INS = (
    Situation("a lock-in's ticks beside their clock", polled(ALL, clockbase=60e6), RIGHT, BY_CELL),
    Situation("a lock-in's ticks without their clock", polled(ALL), refused("r.mat", *ASKED), BY_CELL),
    Situation("a lock-in's ticks in HDF5 beside their size", made("r.h5", lambda path: recorded(path, timebase=1.0 / 60e6)), RIGHT, BY_PATH),
    Situation("a lock-in's ticks in HDF5 without their clock", made("r.h5", recorded), refused("r.h5", *ASKED), BY_PATH),
    Situation("a lock-in's ticks in text", text(COUNTED), refused("r.csv", *ASKED), BY_NAME),
    Situation("a lock-in's ticks in text, and the clock", text(COUNTED), RIGHT, BY_NAME | {"time": "timestamp:60 MHz"}),
    Situation("a lock-in's ticks in text, and the size of one", text(COUNTED), RIGHT, BY_NAME | {"time": "timestamp:16.6666667 ns"}),
    Situation("a lock-in's ticks and a clock that gives another rate", text("# fs = 1000 Hz\n" + COUNTED), refused("r.csv", "3500 Hz", "1000 Hz", "correct one"), BY_NAME | {"time": "timestamp:210 MHz"}),
    Situation("a lock-in's ticks in a manifest", text(COUNTED), RIGHT, {"manifest": IN_TICKS.replace("UNIT", "60e6 Hz")}),
    Situation("a clock of no rate in a manifest", text(COUNTED), refused("dataset.toml", "time_unit", "must be > 0"), {"manifest": IN_TICKS.replace("UNIT", "0 MHz"), "file": "manifest"}),
    Situation("a clock in the manifest that the file contradicts", made("r.h5", lambda path: recorded(path, timebase=1.0 / 60e6)), refused("dataset.toml", '"60000000 Hz"', 'time_unit = "s"', "correct one"), {"manifest": IN_TICKS.replace("UNIT", "s").replace('"timestamp"', '"000/dev1234/demods/0/sample/timestamp"').replace('"x [V]"', '"000/dev1234/demods/0/sample/x"').replace('"y [mm]"', '"000/dev1234/demods/0/sample/y"'), "file": "manifest"}),
    Situation("a row for each field of a lock-in", text(swept_in_rows()), refused("r.csv", "a row for each field", "columns are needed", "MATLAB or HDF5")),
)  # fmt: skip
SITUATIONS = (*SCOPES, *LOCK_INS)
