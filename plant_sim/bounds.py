"""Bounds of the numbers in a device file, beside their units: `Annotated[float, Quantity("s"), POSITIVE]`."""

from __future__ import annotations

from typing import Any

from pydantic import Field

FINITE: Any = Field(allow_inf_nan=False)
POSITIVE: Any = Field(gt=0.0, allow_inf_nan=False)
NOT_NEGATIVE: Any = Field(ge=0.0, allow_inf_nan=False)
