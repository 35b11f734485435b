"""Without the token nobody reads or writes; a foreign host or origin is refused; without --control nobody writes."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest
from page_cases import RecordedLoop, asked, served, viewer

from rtctl.border.errors import InputError
from rtctl.live_page.served.access import token_of
from rtctl.live_page.served.server import MOST_VIEWERS

EVERYTHING = ("", "index.html", "js/main.js", "runs", "stream", "history", "parameters")
CHANGE = '{"name": "setpoint", "value": "30"}'


@pytest.mark.parametrize("token", ["", "another-token", "%C3%A4", "..", "%00"])
def test_without_the_token_nothing_is_read_or_changed(tmp_path: Path, token: str) -> None:
    with served(tmp_path, control=True) as server:
        root = f"http://127.0.0.1:{server.server_port}/"
        for what in EVERYTHING:
            status, text, _ = asked(root, f"{token}/{what}")
            assert (status, "token" in text) == (403, True), what
        status, text, _ = asked(root, f"{token}/control", method="POST", body=CHANGE)
        assert (status, "token" in text) == (403, True)


def test_the_page_comes_with_all_that_it_needs_and_asks_nobody_else(tmp_path: Path) -> None:
    with served(tmp_path) as server:
        status, text, headers = asked(server.address)
        assert status == 200
        assert 'data-may-change="no"' in text
        assert "connect-src 'self'" in headers["Content-Security-Policy"]
        assert headers["Referrer-Policy"] == "no-referrer", "the address holds the token"
        for name in ("style.css", "js/main.js", "vendor/uPlot.iife.min.js", "vendor/LICENSE-uPlot.txt"):
            status, text, _ = asked(server.address, name)
            assert status == 200, name
            assert "http://" not in text.replace("http://www.w3.org", ""), name


@pytest.mark.parametrize("host", ["example.org", "127.0.0.1.example.org:80", "192.0.2.1:8787", "", "[::"])
def test_another_host_is_refused_a_tunnel_is_not(tmp_path: Path, host: str) -> None:
    with served(tmp_path) as server:
        assert asked(server.address, Host=host)[0] == 403
        assert asked(server.address, Host="localhost:9000")[0] == 200


@pytest.mark.parametrize("origin", ["http://example.org", "null", "https://127.0.0.1", "http://127.0.0.1:1"])
def test_a_page_of_another_origin_is_refused(tmp_path: Path, origin: str) -> None:
    with served(tmp_path, control=True) as server:
        own = server.address.rpartition("/")[0].rpartition("/")[0]
        assert asked(server.address, "runs", Origin=origin)[0] == 403
        assert asked(server.address, "runs", Origin=own)[0] == 200
        status, _, _ = asked(
            server.address,
            "control",
            method="POST",
            body=CHANGE,
            Origin=origin,
            Content_Type="application/json",
        )
        assert status == 403


def test_without_control_the_page_only_shows(tmp_path: Path) -> None:
    with served(tmp_path) as server:
        status, text, _ = asked(
            server.address, "control", method="POST", body=CHANGE, Content_Type="application/json"
        )
        assert (status, "--control" in text) == (403, True)


@pytest.mark.parametrize(
    ("body", "headers", "status"),
    [
        (CHANGE, {"Content_Type": "text/plain"}, 415),
        ("{" * 5000, {"Content_Type": "application/json"}, 413),
        ("{", {"Content_Type": "application/json"}, 409),
        ("[1]", {"Content_Type": "application/json"}, 409),
        ('{"name": 3}', {"Content_Type": "application/json"}, 409),
        (CHANGE, {"Content_Type": "application/json"}, 409),  # no run is under way
    ],
)
def test_what_is_no_change_is_refused_in_words(
    tmp_path: Path, body: str, headers: dict[str, str], status: int
) -> None:
    with served(tmp_path, control=True) as server:
        found, text, _ = asked(server.address, "control", method="POST", body=body, **headers)
        assert found == status
        assert "Traceback" not in text
        assert len(text) > 10


@pytest.mark.parametrize(
    ("what", "status"),
    [
        ("../served/access.py", 404), ("js/../../watching.py", 404), ("%2e%2e/plotjuggler.py", 404), ("nothing", 404),
        ("/etc/hosts.txt", 404),
        ("history?points=0", 409), ("history?points=1e9", 409), ("history?from=x", 409), ("history?from=nan", 409),
        ("history?from=2&to=1", 409), ("history?run=../..", 409), ("history", 409), ("parameters", 409),
    ],
)  # fmt: skip
def test_a_wrong_question_is_answered_in_words(tmp_path: Path, what: str, status: int) -> None:
    with served(tmp_path) as server:
        found, text, _ = asked(server.address, what)
        assert found == status
        assert "Traceback" not in text
        assert text.strip()


def test_more_viewers_than_seats_are_turned_away_and_a_seat_is_free_again_when_one_goes(
    tmp_path: Path,
) -> None:
    RecordedLoop(tmp_path).append(3)
    with served(tmp_path) as server:
        for _ in range(MOST_VIEWERS - 1):
            assert server.seats.acquire(blocking=False)
        with viewer(server.address) as events:
            assert next(events).kind == "run"
            assert asked(server.address, "stream")[0] == 503
        assert server.seats.acquire(timeout=10.0), "the server notices that the browser went away"


def test_a_port_that_is_taken_is_said_and_without_one_another_is_found(tmp_path: Path) -> None:
    with served(tmp_path) as server, pytest.raises(InputError, match="is taken by another program"):
        served(tmp_path, port=server.server_port).__enter__()
    with pytest.raises(InputError, match="--port 70000: cannot be used"):
        served(tmp_path, port=70_000).__enter__()
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(InputError, match="is taken"):
            served(tmp_path, port=taken.getsockname()[1]).__enter__()


def test_the_token_is_the_same_for_the_same_folder_and_its_key_is_private(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    token = token_of(tmp_path)
    assert len(token) >= 22
    assert token_of(tmp_path) == token
    assert token_of(tmp_path / "other") != token
    key = tmp_path / "state" / "rtctl" / "watch.key"
    assert key.stat().st_mode & 0o777 == 0o600
    key.chmod(0o644)
    assert token_of(tmp_path) != token, "a key that others can read is not used"
    monkeypatch.setenv("XDG_STATE_HOME", "/proc/nowhere")
    assert token_of(tmp_path) != token_of(tmp_path)
