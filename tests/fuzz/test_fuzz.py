"""A few random inputs of every kind end in numbers or in a message; what does not is found (`make fuzz` runs many)."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from random import Random

import pytest

sys.path.append(str(Path(__file__).parents[1] / "measured"))

import fuzz_run
from fuzz_targets import Target, targets


@pytest.mark.parametrize("name", targets())
def test_random_inputs_end_in_numbers_or_in_a_message(name: str, tmp_path: Path) -> None:
    target = targets()[name]
    target.prepare()
    for k in range(12):
        try:
            target.case(Random(f"ci/{name}/{k}"), tmp_path)
        except target.messages as error:
            assert str(error).strip()  # noqa: PT017 - most inputs are refused, some are read


def outside(rng: Random, folder: Path) -> None:
    (folder.parent / "elsewhere").write_text("x")


def inside(rng: Random, folder: Path) -> None:
    (folder / "here").write_text(str(rng.random()))


def fails(rng: Random, folder: Path) -> None:
    raise KeyError("x")


def refuses(rng: Random, folder: Path) -> None:
    raise ValueError("is damaged")


def fails_in_silence(rng: Random, folder: Path) -> None:
    raise ValueError


def crashes(rng: Random, folder: Path) -> None:
    if rng.random() < 0.5:
        os.kill(os.getpid(), signal.SIGSEGV)


def hangs(rng: Random, folder: Path) -> None:
    signal.pause()


@pytest.mark.parametrize(
    ("case", "kinds"),
    [
        (inside, set()),
        (refuses, set()),
        (fails, {"traceback"}),
        (fails_in_silence, {"traceback"}),
        (outside, {"files"}),
        (crashes, {"crash"}),
        (hangs, {"hang"}),
    ],
)
@pytest.mark.filterwarnings(
    "ignore:This process:DeprecationWarning"
)  # the child runs nothing of other threads
def test_what_a_fuzzer_is_to_find_is_found(
    monkeypatch: pytest.MonkeyPatch, case: fuzz_run.Case, kinds: set[str]
) -> None:
    monkeypatch.setattr(fuzz_run, "LONGEST_S", 0.2)
    outcome = fuzz_run.run("self", Target(case, (ValueError,)), 1, range(3))
    assert outcome.inputs == 3
    assert {one["kind"] for one in outcome.found} == kinds
    assert outcome.refused == (3 if case is refuses else 0)
