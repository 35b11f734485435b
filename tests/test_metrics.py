"""Scores are what a person computes by hand, and what was not measured is null, never zero."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from rtctl.evaluation.metrics import ErrorScore, score, write_json
from rtctl.version import __version__


def test_errors_by_hand() -> None:
    wanted, reference = np.array([1.0, 2.0, 3.0, 4.0]), np.array([1.0, 4.0, 3.0, 0.0])
    figures = score(wanted, reference, 50.0)
    assert figures.mean_abs == pytest.approx(1.5)
    assert figures.max_abs == pytest.approx(4.0)
    assert figures.rms == pytest.approx(math.sqrt(5.0))
    assert figures.mean_abs_percent == pytest.approx(3.0)
    assert figures.max_abs_percent == pytest.approx(8.0)
    assert figures.rms_percent == pytest.approx(2.0 * math.sqrt(5.0))


def test_samples_without_a_reference_are_not_scored() -> None:
    figures = score(np.array([1.0, 100.0]), np.array([3.0, np.nan]), 50.0)
    assert (figures.mean_abs, figures.max_abs) == (2.0, 2.0)


def test_no_reference_at_all_scores_null() -> None:
    assert score(np.ones(3), np.full(3, np.nan), 50.0) == ErrorScore(None, None, None, None, None, None)
    assert score(np.ones(0), np.ones(0), 50.0).mean_abs is None


def test_an_estimate_that_is_no_number_is_an_infinite_error_not_a_skipped_one() -> None:
    figures = score(np.array([1.0, np.nan]), np.array([1.0, 1.0]), 50.0)
    assert figures.max_abs_percent == math.inf
    assert figures.mean_abs == math.inf


@pytest.mark.parametrize("output_range", [0.0, -1.0, math.nan])
def test_a_range_that_is_none_is_refused(output_range: float) -> None:
    with pytest.raises(ValueError, match="output_range must be > 0"):
        score(np.ones(1), np.ones(1), output_range)


def test_json_has_null_for_what_is_not_finite_and_python_s_own_numbers(tmp_path: Path) -> None:
    content = {
        "a": [np.float64(1.5), math.nan, {"b": -math.inf}],
        "n": np.int64(3),
        "yes": np.bool_(True),
        "array": np.array([1.0, np.nan]),
        "text": "µ",
    }
    write_json(tmp_path / "new" / "summary.json", content, "run")
    assert json.loads((tmp_path / "new" / "summary.json").read_text(encoding="utf-8")) == {
        "program": f"rtctl run {__version__}",
        "a": [1.5, None, {"b": None}],
        "n": 3,
        "yes": True,
        "array": [1.0, None],
        "text": "µ",
    }


def test_a_write_that_breaks_keeps_the_summary_that_was_there(tmp_path: Path) -> None:
    path = tmp_path / "summary.json"
    write_json(path, {"verdict": "pass"}, "run")
    with pytest.raises(TypeError):
        write_json(path, {"verdict": object()}, "run")
    assert json.loads(path.read_text())["verdict"] == "pass"
    assert [entry.name for entry in tmp_path.iterdir()] == ["summary.json"]
