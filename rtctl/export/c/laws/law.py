"""An exportable law: the function of a sample, its constants, its memory, and where each constant comes from."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.records import DeviceProfile
from rtctl.translation.memory import Memory
from rtctl.translation.types import BOOL, INT, LONG, REAL, ArrayType, Field, RecordType


def nth(name: str, k: int) -> str:
    """Return the name of the field of a channel: the first one has the plain name."""
    return name if k == 0 else f"{name}_{k + 1}"


def input_record(profile: DeviceProfile) -> RecordType:
    """Return what a sample needs, of a device with some readings."""
    unit = profile.reference.unit
    readings = [
        Field(nth("sensed", k), REAL, 0, f"the reading of {one.name} [{one.unit}]; NaN where there is none")
        for k, one in enumerate(profile.sensed)
    ]
    upcoming = f"the setpoint that the next command aims at [{unit}]; as `setpoint` if unknown"
    return RecordType(
        "rtctl_in",
        (
            *readings,
            Field("setpoint", REAL, 0, f"the setpoint of this sample [{unit}]"),
            Field("upcoming", REAL, 0, upcoming),
            Field("periods", INT, 0, "periods since the sample before: 1, or more where some were missed"),
            Field("status", INT, 0, "the device's status bits: docs/registers.md"),
            Field("counter", LONG, 0, "the device's sample counter, modulo 2^32"),
            Field("time_us", LONG, 0, "the device's time [us], modulo 2^32"),
            Field("begun_ns", LONG, 0, "time of the request on this machine's clock [ns]"),
            Field("answered_ns", LONG, 0, "time of its answer [ns]"),
        ),
    )


def output_record(
    profile: DeviceProfile, surrogate: tuple[str, str], terms: Sequence[tuple[str, str]]
) -> RecordType:
    """Return what a sample gives, of a device with some commands.

    Args:
        profile: the device's channels.
        surrogate: name and unit of the estimator's second value.
        terms: names and units of the controller's terms.
    """
    unit = profile.reference.unit
    levels = [
        Field(nth("level", k), REAL, 0, f"the next {one.name} [{one.unit}]; the safe one after a fault")
        for k, one in enumerate(profile.commands)
    ]
    return RecordType(
        "rtctl_out",
        (
            *levels,
            Field("estimate", REAL, 0, f"{profile.reference.name} [{unit}]"),
            Field("surrogate", REAL, 0, f"{surrogate[0]} [{surrogate[1]}]"),
            Field("standard_error", REAL, 0, f"of the estimate [{unit}]"),
            *(Field(name, REAL, 0, f"term of a command [{unit or 'dimensionless'}]") for name, unit in terms),
            Field("estimate_status", INT, 0, "bits of the estimate: 1 saturated, 2 in a gap, ...; 0: none"),
            Field("fault", INT, 0, "0: none; it is kept until rtctl_init"),
        ),
    )


class Corners(NamedTuple):
    """Values that the readings and setpoints of a proof beyond healthy runs wander over."""

    readings: tuple[float, float]
    """Of each reading [its unit]; both positive: evenly over their logarithm."""
    setpoints: tuple[float, float]
    """[controlled unit]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """What is exported."""

    name: str
    sample: Callable[..., Any]
    """Function of a sample: (state, input, output, constants)."""
    constants: Any
    """NamedTuple of NamedTuples."""
    memory: tuple[Memory, ...]
    input: RecordType
    """What a sample needs."""
    output: RecordType
    """What it gives."""
    corners: Corners
    sources: Mapping[str, str] = field(default_factory=dict)
    """Where constants come from, by `part.field` or `part`."""
    settle_steps: int = 0

    @property
    def state(self) -> RecordType:
        """Return the record of the state."""
        return RecordType("rtctl_state", tuple(entry.field for entry in self.memory))


def aligned_dtype(record: RecordType, real: Any) -> np.dtype[Any]:
    """Return a record of numbers as C lays it out, with reals of one precision."""
    kinds = {REAL: real, INT: np.int32, LONG: np.int64}
    return np.dtype([(one.name, kinds[one.type]) for one in record.fields], align=True)  # type: ignore[index]


def numpy_dtype(record: RecordType, real: Any) -> np.dtype[Any]:
    """Return a record as a structured dtype with reals of one precision."""
    kinds = {REAL: real, INT: np.int64, LONG: np.int64, BOOL: np.bool_}
    return np.dtype(
        [
            (one.name, real, (one.size,)) if isinstance(one.type, ArrayType) else (one.name, kinds[one.type])
            for one in record.fields
        ]
    )
