"""Every file of the corpus is read right, or refused in one message that names file, place and remedy.

The tables of situations are in `corpus_*.py`: a row is a name, a file, what must come of it, and what the user says.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import corpus_binary
import corpus_fields
import corpus_habits
import corpus_instruments
import corpus_labs
import corpus_lines
import corpus_numbers
import corpus_split_times
import corpus_stated
import corpus_sweeps
import corpus_text
import corpus_time
import corpus_words
import numpy as np
import pytest
from corpus_case import SWEEP, TRUTH, Refused, Right, RightSweep, Situation

import rtctl
from rtctl.border.errors import InputError
from rtctl.measured.manifest.schema import read_manifest
from rtctl.measured.units import convert_column

TABLES = (
    corpus_text,
    corpus_lines,
    corpus_time,
    corpus_numbers,
    corpus_binary,
    corpus_fields,
    corpus_habits,
    corpus_stated,
    corpus_sweeps,
    corpus_labs,
    corpus_instruments,
    corpus_split_times,
    corpus_words,
)
SITUATIONS = [one for module in TABLES for one in module.SITUATIONS]


def test_the_corpus_is_as_large_as_is_said() -> None:
    names = [one.name for one in SITUATIONS]
    assert len(names) == len(set(names))
    assert len(names) >= 150


@pytest.mark.parametrize("one", SITUATIONS, ids=lambda one: one.name)
@pytest.mark.filterwarnings("ignore")  # of libraries, about damaged files
def test_a_file_is_read_right_or_refused_with_a_remedy(one: Situation, tmp_path: Path) -> None:
    path = one.write(tmp_path)
    said = dict(one.said)
    if "renamed" in said:
        path = path.rename(tmp_path / said.pop("renamed"))
    if isinstance(one.expected, Refused):
        with pytest.raises(InputError) as caught:
            open_as_a_user(path, said)
        message = str(caught.value)
        assert (path.name if said.get("file") != "manifest" else "dataset.toml") in message
        assert [word for word in one.expected.words if word not in message] == [], message
        return
    dataset, unsure = open_as_a_user(path, said)
    assert one.expected.remark in " ".join([*unsure, *dataset.remarks]), (unsure, dataset.remarks)
    if isinstance(one.expected, RightSweep):
        check_sweeps(dataset)
    else:
        check_truth(dataset, one.expected)


def open_as_a_user(path: Path, said: dict[str, Any]) -> tuple[rtctl.Dataset, tuple[str, ...]]:
    """By `rtctl init`, or with a manifest of the user's own."""
    if "manifest" in said:
        manifest = path.parent / "dataset.toml"
        manifest.write_text(said["manifest"].replace("FILE", path.name))
        return rtctl.read_dataset(manifest), ()
    made = rtctl.init(path, plot=False, **said)
    return rtctl.read_dataset(made.path), made.unsure


def check_sweeps(dataset: rtctl.Dataset) -> None:
    frequency, drive, z = SWEEP
    volts = convert_column(np.ones(1), dataset.units["drive"], "V")[0]
    um = convert_column(np.ones(1), dataset.units["displacement"], "um")[0]
    read = [one.complex_amplitudes("displacement") for one in dataset.records]
    assert len(read) == 2
    np.testing.assert_allclose(np.concatenate([one.frequencies_hz for one in dataset.records]), frequency)
    held = np.concatenate([one.signals["drive"][::2] for one in dataset.records])
    np.testing.assert_allclose(volts * held, drive, rtol=1e-6)
    np.testing.assert_allclose(um * np.concatenate(read), z, rtol=1e-6)


def check_truth(dataset: rtctl.Dataset, expected: Right) -> None:
    kept = np.arange(expected.rows) if expected.lost is None else expected.lost
    tables = read_manifest(dataset.path).records
    seen = np.zeros(expected.rows, dtype=bool)
    for record, entry in zip(dataset.records, tables, strict=True):
        assert math.isclose(1.0 / record.period_s, expected.rate_hz, rel_tol=1e-3)
        first = entry.first_row
        rows = slice(first, first + record.samples)
        seen[rows] = True
        assert {"drive", "displacement"} <= record.signals.keys() or "displacement" not in expected.units
        for name, values in record.signals.items():
            unit = expected.units[name]
            read = convert_column(values, dataset.units[name], unit)
            truth = TRUTH[name]
            instants = kept[first] + np.arange(record.samples) if entry.resample else kept[rows]
            there = np.isin(instants, kept)  # what is between is interpolated
            error = np.abs(read - truth[instants])[there].max() / np.abs(truth).max()
            assert error < expected.within, f"{record.name} {name}: {read[:3]} for {truth[instants][:3]}"
    assert seen.sum() >= expected.fewest, f"{seen.sum()} of {expected.fewest} rows are read"
