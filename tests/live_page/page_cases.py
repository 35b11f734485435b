"""A recording without a loop behind it, and a viewer of its page over a real socket."""

from __future__ import annotations

import base64
import http.client
import json
import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import numpy as np

from rtctl.controllers.pi import NoFeedforward, PiController, PiGains
from rtctl.estimators.none import NoEstimator
from rtctl.live_page.served.access import Access
from rtctl.live_page.served.server import PageServer, page_served
from rtctl.loop.supervisor import TIMING_COLUMNS, signal_columns
from rtctl.scenario.schema import load_scenario
from rtctl.session.run_folder import RunFolder, run_metadata, write_tables

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"
PATIENCE_S = 30.0
TOKEN = "a-token-of-the-tests-1"


class RecordedLoop:
    """Rows as a loop of the bundled scenario `steps` records them; row k has the setpoint `begin + k`."""

    def __init__(self, folder: Path, *overrides: str, begin: float = 0.0) -> None:
        scenario, tables = load_scenario(SCENARIOS / "steps.toml", list(overrides))
        self.folder, self.begin, self.count = folder, begin, 0
        self.metadata = run_metadata(tables)
        controller = PiController(PiGains(kp=0.1, ki=1.0), NoFeedforward(), deadband=0.0)
        self.columns = signal_columns(scenario.profile, NoEstimator(), controller)
        self.recording = RunFolder(path=folder, metadata=self.metadata, model=None).record(
            self.columns, TIMING_COLUMNS
        )

    def append(self, rows: int, missed: int = 0) -> None:
        """Record rows; `missed` periods are left out before the first of them."""
        self.begin += missed
        for _ in range(rows):
            setpoint, k = self.begin + self.count, self.count
            measured = [setpoint - 0.5, 5e4 - k, 7.0 + 1e-3 * k]
            estimate = [setpoint - 0.25, math.nan, 0.125, 0.0]
            terms = (len(self.columns) - 12) * [0.0]
            row = (setpoint, setpoint, *estimate, *measured, *terms, float(k), 1e3 * k, 1.0)
            self.recording.signals.append(row)
            self.recording.timings.append((float(k % 50), 20.0, 3.0))
            self.count += 1

    def end(self) -> None:
        """End it as a run does: Parquet files in place of the rows under way."""
        signals, timings = self.recording.close()
        write_tables(self.folder, signals, timings, dict(self.columns), self.metadata)


class Event(NamedTuple):
    """One Server-Sent Event."""

    kind: str
    number: str
    content: Any

    @property
    def setpoints(self) -> list[float]:
        """The first signal of an event of rows."""
        values = np.frombuffer(base64.b64decode(self.content["values"]), dtype="<f4")
        return values[: self.content["count"]].tolist()


@contextmanager
def served(folder: Path, *, control: bool = False, port: int = 0) -> Iterator[PageServer]:
    """Serve the page of a folder by threads of this process."""
    with page_served(folder, Access(TOKEN, control), port) as server:
        yield server


def asked(
    address: str, what: str = "", *, method: str = "GET", body: str | None = None, **headers: str
) -> tuple[int, str, http.client.HTTPMessage]:
    """Make one request below the address of a page; return status, text and headers of the answer."""
    url = urlsplit(address)
    connection = http.client.HTTPConnection(url.hostname or "", url.port, timeout=5.0)
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.request(method, url.path + what, body, named)
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer.status, text, answer.headers


@contextmanager
def viewer(address: str, last: str = "", run: str = "") -> Iterator[Iterator[Event]]:
    """Open the stream of a page as a browser does; yield its events."""
    url = urlsplit(address)
    connection = http.client.HTTPConnection(url.hostname or "", url.port, timeout=5.0)
    connection.request("GET", f"{url.path}stream?run={run}", headers={"Last-Event-ID": last} if last else {})
    answer = connection.getresponse()
    assert answer.status == 200, answer.read()
    try:
        yield _events(answer)
    finally:
        answer.close()
        connection.close()


def rows_until(events: Iterator[Event], last_row: int) -> list[Event]:
    """Return the events of rows up to the one that ends with row `last_row`."""
    found = []
    for event in events:
        if event.kind == "rows":
            found.append(event)
            if event.content["first"] + event.content["count"] - 1 >= last_row:
                return found
    raise AssertionError(f"the stream ended before row {last_row}")


def _events(answer: http.client.HTTPResponse) -> Iterator[Event]:
    fields: dict[str, str] = {}
    deadline = time.monotonic() + PATIENCE_S
    while line := answer.readline().decode():
        assert time.monotonic() < deadline, "what the test waits for never came"
        name, _, value = line.rstrip("\n").partition(": ")
        if line == "\n" and "data" in fields:
            yield Event(fields.get("event", ""), fields.get("id", ""), json.loads(fields["data"]))
        if line == "\n":
            fields = {}
        elif name:
            fields[name] = value
