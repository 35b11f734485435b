"""The streams that a watch feeds beside the page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, Protocol

from rtctl.live_page.streams.epics import EpicsSender
from rtctl.live_page.streams.mcap_files import McapRecorder
from rtctl.live_page.streams.plotjuggler import PlotJugglerSender


class Stream(Protocol):
    """A stream: it looks for new rows when it is asked to, and waits for nobody."""

    def look(self) -> object:
        """Hand on what is new."""
        ...

    def close(self) -> None:
        """End."""
        ...


class Streams(NamedTuple):
    """Which streams a user wants."""

    plotjuggler: str | None = None
    """HOST:PORT for UDP packets."""
    mcap: Path | None = None
    """File that grows with the run."""
    epics: str | None = None
    """Prefix of process variables."""


def opened(streams: Streams, folder: Path, may_change: bool) -> Iterator[Stream]:
    """Open streams of what is recorded in `folder`, one after the other; `may_change`: whether they may change the run.

    Raises:
        InputError: an argument is wrong, or a package is missing.
    """
    if streams.plotjuggler is not None:
        yield PlotJugglerSender(folder, streams.plotjuggler)
    if streams.mcap is not None:
        yield McapRecorder(folder, streams.mcap)
    if streams.epics is not None:
        yield EpicsSender(folder, streams.epics, may_change)
