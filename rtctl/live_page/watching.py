"""A watch from its arguments to its end: what is watched, the page, the streams for other programs."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from rtctl.border.errors import InputError, RtctlError
from rtctl.live_page.recorded.followed import FollowedRun
from rtctl.live_page.recorded.places import is_recording, places_in
from rtctl.live_page.served.access import Access, token_of
from rtctl.live_page.served.relay import page_relayed, upstream_of
from rtctl.live_page.served.server import page_served
from rtctl.live_page.shown.state import words_of
from rtctl.live_page.streams.chosen import Stream, Streams, opened
from rtctl.session.live.control_socket import NAME
from rtctl.session.run_folder import SIGNALS

LOOKS_A_SECOND = 30.0
PAGE_SCHEME = "http://"


def watch(
    folder: Path | str,
    *,
    port: int | None,
    may_change: bool,
    streams: Streams,
    ready: Callable[[str], None],
    stop_requested: Callable[[], bool],
) -> None:
    """Serve the page until a stop is requested.

    Args:
        folder: the watched folder, or the address of a page that is served elsewhere.
        port: of this machine; 0: a free one; None: the usual one, or a free one where that is taken.
        may_change: whether the page may change the run.
        streams: what else is fed.
        ready: is told the address of the page.
        stop_requested: whether to end.

    Raises:
        InputError: an argument is wrong.
    """
    with ExitStack() as stack:
        fed: list[Stream] = []
        if isinstance(folder, str):
            if streams != Streams():
                raise InputError(
                    "--plotjuggler, --mcap, --epics: streams are fed where the run is recorded; give them to the "
                    "rtctl watch there"
                )
            upstream = upstream_of(folder)
            access = Access(token_of(Path(folder)), may_change)
            address = stack.enter_context(page_relayed(upstream, access, port)).address
        else:
            for stream in opened(streams, folder, may_change):
                stack.callback(stream.close)
                fed.append(stream)
            access = Access(token_of(folder), may_change)
            address = stack.enter_context(page_served(folder, access, port)).address
        ready(address)
        while not stop_requested():
            time.sleep(1.0 / LOOKS_A_SECOND)
            fed = [stream for stream in fed if _goes_on(stream)]


def _goes_on(stream: Stream) -> bool:
    """Let a stream look for new rows; return whether it goes on. The page does in any case."""
    try:
        stream.look()
    except RtctlError as error:
        print(f"rtctl watch: {error}", file=sys.stderr)
        return False
    return True


def watched_folder(run: Path) -> Path:
    """Return the folder that holds a run, or will. Raises InputError."""
    if not run.exists():
        raise InputError(f"{run}: there is no run; give the folder of a run (its --out), or of several")
    if not run.is_dir():
        raise InputError(f"{run}: is a file; give the folder of the run: {run.parent}")
    return run


def first_words(folder: Path) -> str:
    """Return what to say at first of a folder that shows no row: none is recorded yet, or never will be; "" else."""
    run = FollowedRun(folder)
    try:
        run.look()
        state, begun = run.state(), run.stands_in() is not None
        if not run.has_no_row() or (begun and state == "waiting"):
            return ""
    finally:
        run.close()
    if state == "waiting":
        return f"{folder}: nothing is recorded there yet; the page begins with the first run"
    return f"{folder}: {words_of(state, run.why)}; the page begins with the next run"


def live_source(address: str) -> Path | str:
    """Return what `--live ADDRESS` names: the folder of a run under way, or the address of a page served elsewhere.

    A run under way has one of two addresses on its machine: its folder, or the control socket in it. Raises
    InputError, also where nothing is being recorded there.
    """
    if address.startswith(PAGE_SCHEME):
        return address
    path = Path(address)
    folder = path.parent if path.name == NAME else path
    if not folder.is_dir():
        raise InputError(
            f"--live {address}: neither the folder of a run, nor its {NAME}, nor the address of a page (http://...)"
        )
    if not any(is_recording(place.folder / SIGNALS) for place in places_in(folder)):
        raise InputError(
            f"--live {address}: no run is under way there; rtctl watch {folder} shows what was recorded"
        )
    return folder
