"""[references.NAME]: what further outputs of a device track, beside the [reference] of the loop's own output."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import BeforeValidator, TypeAdapter, ValidationInfo

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError, nearest
from rtctl.border.records import Channel, DeviceProfile
from rtctl.models.span import Span
from rtctl.signals.references import Multisine, Reference, Steps

_REFERENCE: TypeAdapter[Steps | Multisine] = TypeAdapter(Reference)


def _in_own_units(raw: Any, info: ValidationInfo) -> Any:
    """Read each table in the unit of its output, which is a reading of the device."""
    profile: DeviceProfile | None = (info.context or {}).get("profile")
    if profile is None or not isinstance(raw, dict):
        return raw
    known = {one.name: one for one in profile.sensed}
    found = {}
    for name, table in raw.items():
        if name not in known:
            raise ValueError(
                f'"{name}" is no output that the loop reads{nearest(name, known)}; only the output of [reference] may '
                "be hidden from it"
            )
        own = replace(profile, reference=known[name])
        found[name] = _REFERENCE.validate_python(table, context={"profile": own})
    return found


FurtherReferences = Annotated[dict[str, Steps | Multisine], BeforeValidator(_in_own_units)]


class Course(NamedTuple):
    """What an output tracks."""

    channel: Channel
    setpoints: FloatArray
    """(n,) [its unit]."""


def course(reference: Steps | Multisine, time_s: FloatArray, reach: Span, unit: str, key: str) -> FloatArray:
    """Return the setpoint at each time (n,).

    Args:
        reference: Table of the output.
        time_s: Times (n,) [s].
        reach: Range of the output [its unit].
        unit: Unit of the output.
        key: Name of the table in messages.

    Raises:
        InputError: The setpoint leaves the output's range.
    """
    try:
        setpoints = reference.build(time_s, *reach)
    except ValueError as error:
        raise InputError(str(error)) from None
    low, high = float(np.min(setpoints)), float(np.max(setpoints))
    if not (low >= reach.low and high <= reach.high):
        raise InputError(
            f"[{key}] asks for {low:.4g} to {high:.4g} {unit}, the model reaches {reach.low:.4g} to "
            f"{reach.high:.4g} {unit}; give levels inside it, or in percent of the range"
        )
    return setpoints
