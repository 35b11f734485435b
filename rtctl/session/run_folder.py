"""The folder of a run: recordings while it runs, Parquet, summary and picture when it has ended or was killed.

signals.rec timing.rec   under way (`rtctl.recording.layout`); gone once the Parquet files are whole
events.jsonl             where the run started, what was changed, what went wrong
model.toml               the model that it ran with, so that a replay finds it
signals.parquet timing.parquet summary.json run.png
"""

from __future__ import annotations

import fcntl
import os
import shlex
import shutil
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.loop.events import Events, append_to
from rtctl.output.own_files import is_written_by, mark_of, refuse_foreign
from rtctl.recording import write_parquet
from rtctl.recording.layout import ColumnsOnDemand, Rows
from rtctl.recording.mapped import Keeper, MappedRecorder
from rtctl.recording.parquet import ROWS_OF_A_GROUP, write_parquet_parts
from rtctl.recording.rows import Columns, Recorder

SIGNALS, TIMING = "signals.rec", "timing.rec"
EVENTS, MODEL = "events.jsonl", "model.toml"
FINISHED = ("signals.parquet", "timing.parquet", "summary.json", "run.png", "doubt.json", EVENTS)
"""What is there of a run that has ended."""
FURTHER_MODELS = ("retuned-*.toml", "retuned-*.json", "retuned-*.npz")
"""Models that took over while a run lasted, since when each was right, what the film had been through by then."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """The recorders and events of a run."""

    signals: Recorder | MappedRecorder
    timings: Recorder | MappedRecorder
    events: Events

    def close(self) -> tuple[Mapping[str, FloatArray], Mapping[str, FloatArray]]:
        """Close the recorders; return the tables of signals and timing."""
        return _table(self.signals), _table(self.timings)


def in_memory(signals: Columns, timing: Columns) -> Recording:
    """Return a recording in memory, for runs that need no file before they end."""
    return Recording(signals=Recorder(signals), timings=Recorder(timing), events=Events())


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFolder:
    """The folder of a run, which it records into once its device has answered."""

    path: Path
    metadata: Mapping[str, str]
    """Metadata that the recordings carry."""
    model: Path | None
    """The model file that the run uses; copied beside the recording."""
    report: Callable[[str], None] = lambda text: None
    is_announced: bool = False
    """Whether `report` is told how to watch the run."""
    keeps_earlier: bool = False
    """Whether a finished run in the folder is moved aside; else it is overwritten, as by a demo that is repeated."""

    def record(self, signals: Columns, timing: Columns) -> Recording:
        """Start recording; move the recording of a killed run into a folder of its own.

        Args:
            signals: names and units of the signals.
            timing: names and units of the times.

        Raises:
            InputError: a run is recording here, or a file of another origin is in the way.
        """
        folder = self.path
        folder.mkdir(parents=True, exist_ok=True)
        if (aside := set_aside(folder)) is not None:
            self.report(f"the recording of a run that was killed is now in {aside}: rtctl recover {aside}")
        if self.keeps_earlier and (aside := set_finished_aside(folder)) is not None:
            self.report(f"{folder} held a run: it is now in {aside}")
        check_run_folder(folder)
        self._check_model(is_kept=aside is not None)
        (folder / "summary.json").unlink(missing_ok=True)  # of an earlier run in the same folder
        if self.model is not None and self.model.resolve() != (folder / MODEL).resolve():
            shutil.copyfile(self.model, folder / MODEL)
        if self.is_announced:
            self.report(watch_words(folder))
        keeper = Keeper()
        return Recording(
            signals=MappedRecorder(folder / SIGNALS, signals, self.metadata, keeper),
            timings=MappedRecorder(folder / TIMING, timing, self.metadata, keeper),
            events=Events(append_to(folder / EVENTS, keeper.ask)),
        )

    def _check_model(self, *, is_kept: bool) -> None:
        """Raise InputError where the copy of the model would replace another model that is not kept aside."""
        place = self.path / MODEL
        if self.model is None or is_kept or not place.exists():
            return
        if self.model.read_bytes() != place.read_bytes():
            refuse_foreign(place, "identify")


def check_run_folder(folder: Path) -> None:
    """Raise InputError where a file is in the way of a run's that no run wrote; a finished run is moved aside."""
    if (folder / FINISHED[0]).is_file() and is_written_by(folder / FINISHED[0], "run"):
        return
    for name in FINISHED[:4]:
        refuse_foreign(folder / name, "run")


def run_metadata(tables: Mapping[str, Any]) -> dict[str, str]:
    """Return a recording's metadata: the scenario as it was run, overrides included."""
    import tomli_w

    return {"scenario": tomli_w.dumps(tables), "program": mark_of("run")}


def watch_words(folder: Path) -> str:
    """Return the line that says how to watch what is recorded below `folder`."""
    return f"watch it: {shlex.join(['rtctl', 'watch', str(folder)])}"


def write_tables(
    folder: Path,
    signals: Mapping[str, FloatArray],
    timing: Mapping[str, FloatArray],
    units: Mapping[str, str],
    metadata: Mapping[str, str],
) -> None:
    """Write `signals.parquet` and `timing.parquet`, each whole or not at all; then remove the recordings under way.

    Args:
        folder: the folder of the run.
        signals: columns of signals (n,).
        timing: columns of times (n,) [us].
        units: unit of each signal.
        metadata: goes into both files.
    """
    _write(folder / "signals.parquet", signals, units, metadata)
    _write(folder / "timing.parquet", timing, dict.fromkeys(timing, "us"), metadata)
    (folder / SIGNALS).unlink(missing_ok=True)
    (folder / TIMING).unlink(missing_ok=True)


def is_interrupted(folder: Path) -> bool:
    """Return whether a recording lies here that never became Parquet."""
    return (folder / SIGNALS).is_file()


def refuse_running(folder: Path) -> None:
    """Raise InputError where the recording in `folder` is being written."""
    with (folder / SIGNALS).open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(f"{folder}: a run is recording here; wait for its end, or stop it") from None


def scenario_tables(metadata: Mapping[str, str], source: Path) -> dict[str, Any]:
    """Return the scenario in a recording's metadata. Raises InputError."""
    if "scenario" not in metadata:
        raise InputError(f"{source}: no scenario in its metadata: not recorded by rtctl run")
    return tomllib.loads(metadata["scenario"])


def _write(
    path: Path, table: Mapping[str, FloatArray], units: Mapping[str, str], metadata: Mapping[str, str]
) -> None:
    if isinstance(table, ColumnsOnDemand):
        write_parquet_parts(path, list(table), table.parts(ROWS_OF_A_GROUP), units, metadata, "run")
    else:
        write_parquet(path, table, units, metadata, "run")


def _table(recorder: Recorder | MappedRecorder) -> Mapping[str, FloatArray]:
    return recorder.table() if isinstance(recorder, Recorder) else recorder.close().table()


def set_aside(folder: Path) -> Path | None:
    """Move what a killed run has left into a folder of its own; return that folder, or None.

    Raises InputError where it is being written.
    """
    if not is_interrupted(folder):
        return None
    refuse_running(folder)
    return _moved(folder, "interrupted", (SIGNALS, TIMING, EVENTS, MODEL, *_further_models(folder)))


def set_finished_aside(folder: Path) -> Path | None:
    """Move a run that has ended into a folder of its own, with a copy of its model; return that folder, or None."""
    if not (folder / FINISHED[0]).is_file():
        return None
    aside = _moved(folder, "before", (*FINISHED, *_further_models(folder)))
    if (folder / MODEL).is_file():  # the run that begins may read it
        shutil.copyfile(folder / MODEL, aside / MODEL)
    return aside


def _further_models(folder: Path) -> list[str]:
    """Return the models that took over while the run lasted: without them it cannot be replayed."""
    return sorted(one.name for pattern in FURTHER_MODELS for one in folder.glob(pattern))


def _moved(folder: Path, word: str, names: Sequence[str]) -> Path:
    """Move files of a run to the first folder `word`-1, `word`-2, ... that is not there yet; return that."""
    number = 1
    while (aside := folder / f"{word}-{number}").exists():
        number += 1
    aside.mkdir()
    for name in names:
        if (folder / name).is_file():
            os.replace(folder / name, aside / name)
    return aside


def rows_left_by(folder: Path) -> tuple[Rows, Rows]:
    """Return signals and timing of a run that was killed. Raises InputError if there is no row, or it still runs."""
    if not is_interrupted(folder):
        raise InputError(f"{folder}: no interrupted recording here ({SIGNALS} is missing)")
    refuse_running(folder)
    if not (folder / TIMING).is_file():
        raise InputError(
            f"{folder}: {TIMING} is missing beside {SIGNALS}: this is no run's recording; rtctl watch shows it, and "
            "rtctl export mcap makes a file of it"
        )
    signals = Rows(folder / SIGNALS)
    if len(signals) == 0:
        raise InputError(f"{folder}: the run was killed before its first sample; nothing was recorded")
    return signals, Rows(folder / TIMING)
