"""Scores of a run: tracking and self-sensing errors against the reference instrument, percentiles of timing."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class ErrorScore(NamedTuple):
    """Absolute errors [um] and the same in percent of a range; None where there was nothing to score."""

    mean_abs_um: float | None
    max_abs_um: float | None
    rms_um: float | None
    mean_abs_percent: float | None
    max_abs_percent: float | None


def score(wanted: FloatArray, reference: FloatArray, range_um: float) -> ErrorScore:
    """Errors of `wanted` (n,) against `reference` (n,) [um] where the instrument gave a number."""
    error = np.abs(wanted - reference)
    error = error[np.isfinite(error)]
    if len(error) == 0:
        return ErrorScore(None, None, None, None, None)
    mean, largest, rms = float(error.mean()), float(error.max()), float(np.sqrt(np.mean(error**2)))
    return ErrorScore(mean, largest, rms, 100.0 * mean / range_um, 100.0 * largest / range_um)


def percentiles(values: FloatArray) -> dict[str, float]:
    """p50, p99, p99.9 and max; zeros where nothing was timed."""
    if len(values) == 0:
        return {"p50": 0.0, "p99": 0.0, "p99_9": 0.0, "max": 0.0}
    p50, p99, p999 = np.percentile(values, [50.0, 99.0, 99.9])
    return {"p50": float(p50), "p99": float(p99), "p99_9": float(p999), "max": float(values.max())}


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """A JSON file, whole or not at all; numbers that are not finite become null."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    part.write_text(json.dumps(finite(content), indent=2) + "\n", encoding="utf-8")
    part.replace(path)


def finite(value: Any) -> Any:
    """JSON knows no NaN."""
    if isinstance(value, dict):
        return {key: finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [finite(inner) for inner in value]
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value
