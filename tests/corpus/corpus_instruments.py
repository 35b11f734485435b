"""Exports of oscilloscopes, lock-ins and robots, whose numbers count something that stands beside them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from corpus_binary import made, mat
from corpus_case import MANIFEST, ROWS, Right, Situation, U, Write, X, refused

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


SCOPES = (
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
SITUATIONS = SCOPES
