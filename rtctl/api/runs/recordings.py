"""Runs that were recorded or still are: `replay`, `recover`, `change`, `export_mcap`, `watch`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rtctl.api.documents import Document
from rtctl.api.inputs import PathText, path_of
from rtctl.api.runs.errors import ErrorFigures, error_figures
from rtctl.border.arrays import FloatArray
from rtctl.output.progress import Progress, reporter

if TYPE_CHECKING:
    from rtctl.session.live.control_socket import Taken
    from rtctl.session.replay import Difference


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Replayed:
    """A recorded run computed again, beside its recording."""

    run: Path
    """Folder of the recording."""
    rows: int
    """Samples that were compared."""
    first: Difference | None
    """The first value that differs; None: all are the same to the bit."""
    differing: Mapping[str, int]
    """Number of samples that differ, by column."""
    columns: Mapping[str, FloatArray]
    """What was computed again: setpoints, estimates, terms of the controller, commands, (n,) each."""

    @property
    def same(self) -> bool:
        """Whether all values are the recorded ones, to the bit."""
        return self.first is None

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of the comparison as the command line's `--json` prints them."""
        from rtctl.session.replay import Replay, summary_of

        result = Replay(rows=self.rows, first=self.first, differing=self.differing)
        return summary_of(result, self.run)

    def save(self, folder: PathText) -> Path:
        """Write `replayed.parquet` into a folder."""
        from rtctl.recording import write_parquet

        target = path_of("folder", folder)
        target.mkdir(parents=True, exist_ok=True)
        metadata = {"replay_of": str(self.run)}
        write_parquet(target / "replayed.parquet", dict(self.columns), {}, metadata, "replay")
        return target

    def __repr__(self) -> str:
        if self.first is None:
            return f"<Replayed {self.run}: {self.rows} samples, the same to the bit>"
        return f"<Replayed {self.run}: differs first at sample {self.first.index} in {self.first.column}>"


def replay(run: PathText, *, progress: Progress = False) -> Replayed:
    """Compute a recorded run again through estimator, controller and limits, and compare to the bit.

    Args:
        run: Folder of a run that has ended, or of one that was killed.
        progress: True prints what is under way, a callable hears (text, None).

    Raises:
        InputError: There is no recording, or it does not fit its scenario.
    """
    from rtctl.session import replay as internal

    folder = path_of("run", run)
    recorded = internal.read_run(folder)
    reporter(progress).say(f"computing {len(recorded.signals['index'])} samples of {folder} again")
    result, columns = internal.replay(recorded)
    table = {"index": recorded.signals["index"], **columns}
    return Replayed(
        run=folder, rows=result.rows, first=result.first, differing=result.differing, columns=table
    )


class Recovered(Document):
    """What a killed run left: the content of `summary.json`, and its main figures."""

    @property
    def steps(self) -> int:
        """Number of samples that were recovered."""
        return int(self["timing"]["steps"])

    @property
    def duration_s(self) -> float:
        """How long they last [s]."""
        return self.steps * float(self["timing"]["period_s"])

    @property
    def tracking(self) -> ErrorFigures:
        """How far the output was off the set-point."""
        return error_figures(self["tracking"])

    @property
    def self_sensing(self) -> ErrorFigures:
        """How far the estimate was off the output."""
        return error_figures(self["self_sensing"])

    def figures(self) -> Mapping[str, str]:
        """Return how much was recovered."""
        return {"samples": str(self.steps), "duration": f"{self.duration_s:.4g} s"}


def recover(run: PathText, *, progress: Progress = False) -> Recovered:
    """Make Parquet files, a picture and a summary of what a killed run had recorded.

    Args:
        run: Folder of the run that was killed.
        progress: True prints what is under way, a callable hears (text, None).

    Returns:
        The summary, a dict, with its main figures as attributes.

    Raises:
        InputError: There is no interrupted recording in the folder, or the run still lasts.
    """
    from rtctl.session.recovery import recover as internal

    folder = path_of("run", run)
    reporter(progress).say(f"reading what {folder} holds")
    return Recovered(internal(folder), folder)


class Change(NamedTuple):
    """A change that a run under way has taken."""

    name: str
    """The parameter: "setpoint", "controller.kp" or "controller.ki"."""
    value: float
    """Its new value in the parameter's unit; NaN: the set-points of the scenario again."""


def change(run: PathText, name: str, value: float | str) -> Change:
    """Change the set-point or a gain of a run that is under way; it applies from the next step on.

    Args:
        run: Folder into which the run records.
        name: "setpoint", "controller.kp" or "controller.ki".
        value: A number in the parameter's unit, a text such as "30 um", or "plan": the set-points of the scenario.

    Returns:
        Name and value in the parameter's unit; NaN for "plan".

    Raises:
        InputError: No run is under way, or the change is not possible.
    """
    taken = change_in_words(run, f"{name}={value}")
    return Change(taken.name, taken.value)


def change_in_words(run: PathText, text: str) -> Taken:
    """Make the change that a person writes, `setpoint=30 um`; return what it was from and to. Raises as `change`."""
    from rtctl.session.live.control_socket import read_change, send

    folder = path_of("run", run)
    asked = read_change(folder, text)
    return send(folder, asked.name, asked.value)


def export_mcap(run: PathText, out: PathText, *, progress: Progress = False) -> int:
    """Write a recording as an MCAP file, for PlotJuggler, Foxglove and Lichtblick; return how many rows it has.

    Args:
        run: Folder of a run that is under way, has ended or was killed; of an acquisition or a dataset of one record.
        out: The file, such as "run.mcap".
        progress: True prints what is under way, a callable hears (text, None).

    Raises:
        InputError: Nothing is recorded there, or the package mcap is missing (`pip install 'rtctl[mcap]'`).
    """
    from rtctl.live_page.streams.mcap_files import export_mcap as internal
    from rtctl.live_page.watching import watched_folder

    folder, target = watched_folder(path_of("run", run)), path_of("out", out)
    reporter(progress).say(f"writing {folder} into {target}")
    return internal(folder, target)


# 8 parameters because each is an option of `rtctl watch`
def watch(  # noqa: PLR0913
    run: PathText | None = None,
    *,
    live: str | None = None,
    port: int | None = None,
    control: bool = False,
    plotjuggler: str | None = None,
    mcap: PathText | None = None,
    epics: str | None = None,
    ready: Callable[[str], None] = print,
) -> None:
    """Serve a page that shows a run while it lasts and afterwards, until Ctrl-C or SIGTERM; it blocks.

    Args:
        run: Folder of a run, of several, or of a dataset.
        live: Instead of `run`: the folder or the control socket of a run under way, or the address of a page that is
            served elsewhere.
        port: Of this machine; 0: a free one; None: 8787, or a free one where that is taken.
        control: Whether the page may change set-point and gains, and stop the run.
        plotjuggler: HOST:PORT to which the rows are sent as UDP packets of JSON; None: none are.
        mcap: MCAP file that grows with the run; None: none does.
        epics: Prefix of EPICS process variables of the run, which `control` makes writable; None: there are none.
        ready: Is told the address of the page.

    Raises:
        InputError: There is no such folder, no run is under way, the port is taken, or an address is wrong.
    """
    from rtctl.border.errors import InputError
    from rtctl.live_page import watching
    from rtctl.live_page.streams.chosen import Streams
    from rtctl.output.interrupt import stop_on_interrupt

    if live is None and run is not None:
        source: Path | str = watching.watched_folder(path_of("run", run))
    elif live is not None and run is None:
        source = watching.live_source(live)
    else:
        raise InputError("watch: give either the folder of a run, or live")
    with stop_on_interrupt() as stop_requested:
        watching.watch(
            source,
            port=port,
            may_change=control,
            streams=Streams(
                plotjuggler=plotjuggler, mcap=None if mcap is None else path_of("mcap", mcap), epics=epics
            ),
            ready=ready,
            stop_requested=stop_requested,
        )
