"""Scores of a run: tracking and self-sensing errors against the reference instrument, timing."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.output.atomic_write import replacing


class ErrorScore(NamedTuple):
    """Absolute errors [um], and in percent of a range; None if there was nothing to score."""

    mean_abs_um: float | None
    max_abs_um: float | None
    rms_um: float | None
    mean_abs_percent: float | None
    max_abs_percent: float | None
    rms_percent: float | None = None


NOT_SCORED = ErrorScore(None, None, None, None, None, None)


def score(wanted: FloatArray, reference: FloatArray, range_um: float) -> ErrorScore:
    """Return the errors of `wanted` (n,) against `reference` (n,) [um] where the instrument gave a number.

    Samples without a reference are not scored; a value of `wanted` that is not finite is an infinite error, so that a
    broken estimate fails its checks.

    Args:
        wanted: setpoint or estimate (n,) [um].
        reference: reading of the reference instrument (n,) [um]; NaN: none.
        range_um: the range that percentages are of [um], > 0.

    Raises:
        ValueError: `range_um` is not > 0 um.
    """
    if not range_um > 0.0:
        raise ValueError(f"range_um must be > 0 um, got {range_um!r}")
    scored = np.isfinite(reference)
    if not scored.any():
        return NOT_SCORED
    error = np.abs(wanted[scored] - reference[scored])
    error[~np.isfinite(error)] = math.inf
    figures = (float(error.mean()), float(error.max()), float(np.sqrt(np.mean(error**2))))
    return ErrorScore(*figures, *(100.0 * figure / range_um for figure in figures))


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a JSON file, whole or not at all; numbers that are not finite become null."""
    text = json.dumps(finite(content), indent=2, allow_nan=False, ensure_ascii=False)
    with replacing(path) as partial:
        partial.write_text(text + "\n", encoding="utf-8")


def finite(value: Any) -> Any:
    """Return `value` without NaN and infinity, which JSON does not have, and with Python's own numbers."""
    if isinstance(value, Mapping):
        return {key: finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [finite(inner) for inner in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value
