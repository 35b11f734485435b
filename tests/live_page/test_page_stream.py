"""A viewer gets each row once, also over a restart of the server; a slow one skips, and is told so."""

from __future__ import annotations

import base64
import json
import socket
import threading
import time
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from page_cases import Event, RecordedLoop, asked, rows_until, served, viewer

from rtctl.live_page.served import stream
from rtctl.live_page.served.stream import Stream


def numbers(events: list[Event]) -> list[int]:
    """Return the numbers of the rows in events."""
    return [
        k for one in events for k in range(one.content["first"], one.content["first"] + one.content["count"])
    ]


def test_a_viewer_that_loses_the_server_gets_each_row_once(tmp_path: Path) -> None:
    loop = RecordedLoop(tmp_path, begin=100.0)
    loop.append(500)
    with served(tmp_path) as server:
        port = server.server_port
        with viewer(server.address) as events:
            assert next(events).content["title"] == "1 s steps"
            loop.append(40)
            before = rows_until(events, 540)
    loop.append(7000)  # nobody serves; more rows than one event takes
    with served(tmp_path, port=port) as server, viewer(server.address, before[-1].number) as events:
        assert next(events).content["next"] == 541
        after = rows_until(events, 7540)
        loop.end()
        assert next(event for event in events if event.kind == "state").content["state"] in (
            "recording",
            "ending",
            "ended",
        )
    assert numbers([*before, *after]) == list(range(1, 7541))
    setpoints = [value for event in (*before, *after) for value in event.setpoints]
    assert setpoints == [100.0 + k for k in range(7540)]


@pytest.mark.parametrize("last", ["00000000-20", "KEY-31", "KEY--1", "KEY-x", "KEY", "\x7f", "-"])
def test_a_viewer_of_another_recording_begins_anew(tmp_path: Path, last: str) -> None:
    loop = RecordedLoop(tmp_path)
    loop.append(30)
    one = Stream(tmp_path, "", "")
    description = next(one.look()).decode()
    one.close()
    key = json.loads(description.partition("data: ")[2])["key"]
    with served(tmp_path) as server, viewer(server.address, last.replace("KEY", key)) as events:
        assert next(events).content["next"] == 1
        assert numbers(rows_until(events, 30)) == list(range(1, 31))


def test_a_run_that_becomes_parquet_goes_on_and_the_next_one_is_announced(tmp_path: Path) -> None:
    loop = RecordedLoop(tmp_path)
    loop.append(20)
    with served(tmp_path) as server, viewer(server.address) as events:
        first = next(events).content
        rows_until(events, 20)
        loop.append(5)
        loop.end()
        assert numbers(rows_until(events, 25)) == list(range(21, 26))
        second = RecordedLoop(tmp_path, begin=9.0)
        second.append(4)
        begun = next(event for event in events if event.kind == "run").content
        assert begun["key"] != first["key"]
        assert numbers(rows_until(events, 4)) == [1, 2, 3, 4]
        second.end()


def test_missed_periods_are_seen_in_the_numbers_of_the_samples(tmp_path: Path) -> None:
    loop = RecordedLoop(tmp_path, "clock.mode=live")
    loop.append(3)
    loop.append(2, missed=4)
    with served(tmp_path) as server, viewer(server.address) as events:
        assert next(events).content["live"] is True
        event = rows_until(events, 5)[0]
        timing = next(one for one in events if one.kind == "timing").content
    samples = np.frombuffer(base64.b64decode(event.content["samples"]), dtype="<i4")
    assert samples.tolist() == [0, 1, 2, 7, 8]
    assert sum(timing["counts"]["lateness"]) == 5
    assert timing["largest_us"]["lateness"] == 4.0


def test_a_viewer_that_is_too_far_behind_skips_to_the_newest_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stream, "WINDOW_ROWS", 100)
    loop = RecordedLoop(tmp_path)
    loop.append(10)
    one = Stream(tmp_path, "", "")
    list(one.look())
    loop.append(500)
    events = [event.decode() for event in one.look()]
    one.close()
    assert events[0].startswith('event: skipped\ndata: {"first": 11, "last": 410}')
    assert '"first": 411, "count": 100' in events[1]


def test_a_browser_that_takes_nothing_holds_no_rows_in_the_server(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stream, "WINDOW_ROWS", 4096)
    looks: list[int] = []
    original = Stream.look

    def counted(self: Stream):
        for event in original(self):
            looks.append(len(event))
            yield event

    monkeypatch.setattr(Stream, "look", counted)
    loop = RecordedLoop(tmp_path)
    loop.append(1)
    with served(tmp_path) as server:
        url = urlsplit(server.address)
        with socket.create_connection((url.hostname or "", url.port or 0)) as slow:
            slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            slow.sendall(f"GET {url.path}stream HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            deadline = time.monotonic() + 4.0
            quiet = 0
            while quiet < 10 and time.monotonic() < deadline:
                before = len(looks)
                loop.append(4000)
                threading.Event().wait(0.05)
                quiet = quiet + 1 if len(looks) == before else 0
            assert quiet == 10, "the server still makes events for a browser that takes none"
            assert sum(looks) < 4e6
            with viewer(server.address) as events:  # another one is not held up
                assert next(events).kind == "run"


def test_any_range_of_a_run_is_given_in_as_many_points_as_asked_for(tmp_path: Path) -> None:
    loop = RecordedLoop(tmp_path)
    loop.append(3000)
    with served(tmp_path) as server:
        whole = json.loads(asked(server.address, "history?points=100")[1])
        some = json.loads(asked(server.address, "history?points=100&from=1&to=1.05")[1])
    assert (whole["rows"], whole["first"], whole["last"], whole["exact"]) == (3000, 1, 3000, False)
    assert (some["first"], some["last"], some["exact"]) == (1001, 1051, True)
    unpack = base64.b64decode
    times = np.frombuffer(unpack(some["time_s"]), dtype="<f8")
    assert times == pytest.approx(1.0 + 1e-3 * np.arange(51))
    low = np.frombuffer(unpack(whole["low"]), dtype="<f4").reshape(-1, len(unpack(whole["time_s"])) // 8)
    high = np.frombuffer(unpack(whole["high"]), dtype="<f4").reshape(low.shape)
    assert low[0, 0] == 0.0
    assert high[0, -1] == 2999.0
    assert low.shape[1] <= 100
