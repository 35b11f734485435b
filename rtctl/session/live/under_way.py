"""An excitation under way: recorded into a folder of its own, so that it can be watched and stopped like a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.border.errors import InputError
from rtctl.loop.live_parameters import ParameterChannel
from rtctl.scenario.schema import Scenario
from rtctl.session.live.control_socket import CHANGES, listening
from rtctl.session.run_folder import EVENTS, SIGNALS, TIMING, RunFolder, run_metadata

FOLDER = "acquiring"
"""Below the folder of the dataset; gone once its record is complete."""
ONLY_STOP = "an excitation is being played, which nothing but stop can change"


class UnderWay(NamedTuple):
    """Where an excitation is recorded while it is played, and what may change it."""

    folder: RunFolder
    changes: ParameterChannel


@contextmanager
def excitation_under_way(
    dataset: Path, scenario: Scenario, tables: Mapping[str, Any], title: str
) -> Iterator[UnderWay]:
    """Yield where to record an excitation; what was recorded there is removed at the end of the block.

    Args:
        dataset: the folder of the dataset.
        scenario: the scenario at the period of this excitation.
        tables: the scenario's tables.
        title: what the page calls it.
    """
    path, changes, is_new = dataset / FOLDER, ParameterChannel(), not dataset.exists()
    changes.judge = _refuse
    metadata = {
        **run_metadata(tables),
        "title": title,
        "period_s": repr(scenario.scenario.period_s),
        "clock": scenario.clock.mode,
        CHANGES: ONLY_STOP,
    }
    with listening(path, changes):
        yield UnderWay(RunFolder(path=path, metadata=metadata, model=None), changes)
        for name in (SIGNALS, TIMING, EVENTS):
            (path / name).unlink(missing_ok=True)
    with suppress(OSError):  # not empty: a recording that was killed earlier lies here
        path.rmdir()
    with suppress(OSError):  # not empty: it was written, or was there before
        if is_new:
            dataset.rmdir()


def _refuse(name: str, value: float) -> str:
    raise InputError(f"{name}: {ONLY_STOP}")
