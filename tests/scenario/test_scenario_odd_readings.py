"""Readings that stand still or jump inside a loop, over a wire: the model ends the run, or they are counted."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from wire_cases import WatchedDevice, served_thread, settings, signals_of, summary_of

from rtctl.border.records import Measurement
from rtctl.cli import main

pytestmark = pytest.mark.wire
SETTLE = 50
STUCK = 150  # the sample from which it stands; the set-point steps at 200
STEPS = settings('reference.hold="0.2 s"', 'scenario.duration="0.8 s"')

Read = Callable[[float, int], float]


class OddlyRead(WatchedDevice):
    """A real simulated device whose resistance goes through `read` with the number of the sample."""

    def __init__(self, read: Read) -> None:
        super().__init__()
        self._read = read

    def read(self) -> Measurement:
        """As a device does, but for the resistance."""
        reading = super().read()
        value = float(np.float32(self._read(reading.sensed[0], len(self.commands) - 1 - SETTLE)))
        return reading._replace(sensed=(value,))


def run_with(read: Read, model: Path, out: Path, *more: str) -> int:
    with served_thread(OddlyRead(read)) as wire:
        words = ["run", "steps", "--model", str(model), "--out", str(out), "--no-plot"]
        return main([*words, *STEPS, *wire, *more])


def sticking() -> Read:
    held: list[float] = []

    def read(resistance: float, sample: int) -> float:
        if sample >= STUCK:
            held.append(resistance)
        return held[0] if held else resistance

    return read


@pytest.mark.parametrize("unlocked", ["true", "false"])
def test_a_reading_that_stands_while_the_model_s_moves_ends_the_run(
    unlocked: str, model_file: Path, tmp_path: Path
) -> None:
    """It stands at the lowest reading so far, and the command moves by a tenth of its range."""
    assert run_with(sticking(), model_file, tmp_path, *settings(f"clock.unlocked={unlocked}")) == 1
    (fault,) = summary_of(tmp_path)["faults"]
    assert fault["fault"] == "frozen_value"
    assert "while the model's reading changed by" in fault["message"]
    assert "then it acknowledged that it is switched off" in fault["message"]
    assert 200 + 20 <= len(signals_of(tmp_path)["index"]) < 200 + 40


def test_a_coarse_converter_that_reads_the_same_for_long_is_believed(
    model_file: Path, tmp_path: Path
) -> None:
    run_with(lambda resistance, _: 400.0 * round(resistance / 400.0), model_file, tmp_path)
    assert summary_of(tmp_path)["faults"] == []
    changes = np.flatnonzero(np.diff(signals_of(tmp_path)["resistance"]))
    assert np.diff(changes).max() > 100


def test_readings_that_the_estimator_did_not_believe_are_counted_in_one_line(
    model_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def read(resistance: float, sample: int) -> float:
        return 20.0 * resistance if sample in range(100, 170, 7) else resistance

    run_with(read, model_file, tmp_path)
    summary = summary_of(tmp_path)
    assert (summary["faults"], summary["readings_disagreed"]) == ([], 10)
    assert capsys.readouterr().out.count("10 of 800 readings were implausible to the estimator") == 1
