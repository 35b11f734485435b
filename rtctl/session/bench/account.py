"""The account of a device on a test bench: recorded like a run, so that the live page shows it; changed like a run.

A folder with `signals.rec` (what the device really does), `events.jsonl` (faults and changes), `control.sock`, and at
the end `signals.parquet`.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from rtctl.border.errors import DriverError
from rtctl.loop.events import Events, append_to
from rtctl.loop.live_parameters import ParameterChannel
from rtctl.output.own_files import mark_of, refuse_foreign
from rtctl.output.readable_units import readable
from rtctl.recording.mapped import Keeper, MappedRecorder
from rtctl.recording.parquet import ROWS_OF_A_GROUP, write_parquet_parts
from rtctl.recording.rows import Columns
from rtctl.session.live.control_socket import PARAMETERS, listening
from rtctl.session.live.injected_faults import bursts_struck
from rtctl.session.run_folder import EVENTS, SIGNALS, set_aside

PARQUET = "signals.parquet"


class BenchAccount:
    """Where the account goes, and where changes come from; nothing here waits."""

    def __init__(
        self, recorder: MappedRecorder, events: Events, channel: ParameterChannel, units: Mapping[str, str]
    ) -> None:
        self._recorder, self._events, self._channel, self._units = recorder, events, channel, units
        self._has_room = True
        self._struck: Counter[str] = Counter()

    def row(self, row: tuple[float, ...]) -> None:
        """Take a row, in the order of the columns; where the disk is full, say so once and take no more."""
        if not self._has_room:
            return
        try:
            self._recorder.append(row)
        except DriverError as error:
            self._has_room = False
            print(f"rtctl serve: {error}; the device goes on without its account", file=sys.stderr)

    def note(self, index: int, kind: str, name: str, value: float) -> None:
        """Note what was done: a "change" of an effect, a "fault", or how many bursts were struck by "chance"."""
        if kind == "change":
            words = f"{name} {readable(value, self._units.get(name, ''))}"
            self._events.note(index, kind, name=name, value=value, message=words)
        elif kind == "chance":
            before, more = self._struck[name], round(value)
            self._struck[name] += more
            self._events.note(index, "fault", fault=name, message=bursts_struck(more, before), count=more)
        else:
            lasts = f"for {readable(value, 's')}" if value > 0.0 else "once"
            self._events.note(index, kind, fault=name, message=lasts)

    def changes(self) -> Iterator[tuple[str, float]]:
        """Yield the changes that are wanted by now."""
        while self._channel:
            yield self._channel.take()


class Accounted(NamedTuple):
    """What an account is of."""

    title: str
    """What the page calls it."""
    period_s: float
    """Time of one step of the index [s]."""
    columns: Columns
    """Names and units of a row."""
    inputs: list[str]
    """Columns against which the others are drawn."""
    units: Mapping[str, str]
    """Units of what can be changed, by name."""
    judge: Callable[[str, float], str]
    """Says what to know of a change; raises InputError on one that must not be made."""
    values: Callable[[], Mapping[str, float]]
    """Returns what can be changed as it is now."""


@contextmanager
def bench_account(folder: Path, of: Accounted) -> Iterator[BenchAccount]:
    """Record into `folder` and take changes there inside the block; write the Parquet file at its end.

    An earlier account in it is replaced, one of a server that was killed moved aside. Raises InputError where something
    is being recorded there, or a file of another origin is in the way.
    """
    folder.mkdir(parents=True, exist_ok=True)
    refuse_foreign(folder / PARQUET, "serve")
    if (aside := set_aside(folder)) is not None:
        print(f"rtctl serve: the account of a server that was killed is now in {aside}", file=sys.stderr)
    metadata = {
        "program": mark_of("serve"), "title": of.title, "period_s": repr(of.period_s), "clock": "lockstep",
        "inputs": json.dumps(of.inputs), PARAMETERS: json.dumps(dict(of.units)),
    }  # fmt: skip
    channel, keeper = ParameterChannel(), Keeper()
    channel.judge, channel.parameters = of.judge, of.values
    recorder = MappedRecorder(folder / SIGNALS, of.columns, metadata, keeper)
    events = Events(append_to(folder / EVENTS, keeper.ask))
    try:
        with listening(folder, channel):
            yield BenchAccount(recorder, events, channel, of.units)
    finally:
        recorded = recorder.close()
        if len(recorded):
            rows = recorded.table()
            write_parquet_parts(
                folder / PARQUET, list(rows), rows.parts(ROWS_OF_A_GROUP), dict(of.columns), metadata, "serve"
            )
        (folder / SIGNALS).unlink(missing_ok=True)
