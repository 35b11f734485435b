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
from rtctl.output.own_files import mark_of


class ErrorScore(NamedTuple):
    """Absolute errors in the output's unit, and in percent of a range; None if there was nothing to score."""

    mean_abs: float | None
    max_abs: float | None
    rms: float | None
    mean_abs_percent: float | None
    max_abs_percent: float | None
    rms_percent: float | None = None

    def to_dict(self, unit: str) -> dict[str, Any]:
        """Return the figures by name: lengths as `mean_abs_um` (they are in um), others beside their unit."""
        figures = self._asdict()
        if unit != LENGTH_UNIT:
            return {**figures, "unit": unit}
        return {
            name if name.endswith("percent") else f"{name}_{LENGTH_UNIT}": value
            for name, value in figures.items()
        }


LENGTH_UNIT = "um"
"""Unit of errors that are lengths, in summaries; the file formats fix it."""
NOT_SCORED = ErrorScore(None, None, None, None, None, None)


def score(wanted: FloatArray, reference: FloatArray, output_range: float) -> ErrorScore:
    """Return the errors of a signal where the instrument gave a number.

    Samples without a reference are not scored; a value of `wanted` that is no number is an infinite error, so
    that a broken estimate fails its checks.

    Args:
        wanted: signal (n,) [unit of the output].
        reference: what the instrument measured (n,), same unit.
        output_range: range that percents refer to, same unit.

    Raises:
        ValueError: the range is not above 0.
    """
    if not output_range > 0.0:
        raise ValueError(f"output_range must be > 0, got {output_range!r}")
    scored = np.isfinite(reference)
    if not scored.any():
        return NOT_SCORED
    error = np.abs(wanted[scored] - reference[scored])
    error[~np.isfinite(error)] = math.inf
    figures = (float(error.mean()), float(error.max()), float(np.sqrt(np.mean(error**2))))
    return ErrorScore(*figures, *(100.0 * figure / output_range for figure in figures))


def write_json(path: Path, content: Mapping[str, Any], command: str) -> None:
    """Write a JSON file, whole or not at all; numbers that are not finite become null.

    Args:
        path: the file.
        content: what it holds beside the key "program", which says that `command` wrote it.
        command: which command writes it.

    Raises:
        InputError: `command` did not write the file that is there.
    """
    marked = {"program": mark_of(command), **content}
    text = json.dumps(finite(marked), indent=2, allow_nan=False, ensure_ascii=False)
    with replacing(path, command) as partial:
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
