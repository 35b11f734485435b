"""An exportable law: the function of a sample, its constants, its memory, and where each constant comes from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.export.c.translation.types import BOOL, INT, LONG, REAL, ArrayType, Field, RecordType


@dataclass(frozen=True, slots=True)
class Memory:
    """A field of the state with its value at the start."""

    name: str
    value: float | int | np.int64 | FloatArray
    comment: str = ""

    @property
    def field(self) -> Field:
        """Return the field of the record."""
        if isinstance(self.value, np.ndarray):
            return Field(self.name, ArrayType(), self.value.size, self.comment)
        kind = LONG if isinstance(self.value, np.int64) else INT if isinstance(self.value, int) else REAL
        return Field(self.name, kind, 0, self.comment)


INPUT = RecordType(
    "rtctl_in",
    (
        Field("sensed", REAL, 0, "the reading [ohm]; NaN where there is none"),
        Field("setpoint", REAL, 0, "the setpoint of this sample [um]"),
        Field(
            "upcoming", REAL, 0, "the setpoint that the next command aims at [um]; as `setpoint` if unknown"
        ),
        Field("periods", INT, 0, "periods since the sample before: 1, or more where some were missed"),
        Field("status", INT, 0, "the device's status bits: docs/registers.md"),
        Field("counter", LONG, 0, "the device's sample counter, modulo 2^32"),
        Field("time_us", LONG, 0, "the device's time [us], modulo 2^32"),
        Field("begun_ns", LONG, 0, "time of the request on this machine's clock [ns]"),
        Field("answered_ns", LONG, 0, "time of its answer [ns]"),
    ),
)
OUTPUT = RecordType(
    "rtctl_out",
    (
        Field("level", REAL, 0, "the next command [mA]; the safe one after a fault"),
        Field("estimate", REAL, 0, "deflection [um]"),
        Field("surrogate", REAL, 0, "temperature as the current that would hold it [mA]"),
        Field("standard_error", REAL, 0, "of the estimate [um]"),
        Field("proportional", REAL, 0, "terms of the command [mA]"),
        Field("integral", REAL),
        Field("feedforward", REAL),
        Field("estimate_status", INT, 0, "bits of the estimate: 1 saturated, 2 in a gap, ...; 0: none"),
        Field("fault", INT, 0, "0: none; it is kept until rtctl_init"),
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """What is exported."""

    name: str
    sample: Callable[..., Any]
    """Function of a sample: (state, input, output, constants)."""
    constants: Any
    """NamedTuple of NamedTuples."""
    memory: tuple[Memory, ...]
    sources: Mapping[str, str] = field(default_factory=dict)
    """Where constants come from, by `part.field` or `part`."""
    settle_steps: int = 0

    @property
    def state(self) -> RecordType:
        """Return the record of the state."""
        return RecordType("rtctl_state", tuple(entry.field for entry in self.memory))


def numpy_dtype(record: RecordType, real: Any) -> np.dtype[Any]:
    """Return a record as a structured dtype with reals of one precision."""
    kinds = {REAL: real, INT: np.int64, LONG: np.int64, BOOL: np.bool_}
    return np.dtype(
        [
            (one.name, real, (one.size,)) if isinstance(one.type, ArrayType) else (one.name, kinds[one.type])
            for one in record.fields
        ]
    )
