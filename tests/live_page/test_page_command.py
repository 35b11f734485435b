"""`rtctl watch` says where the page is and what is wrong with its arguments; a page elsewhere is shown through it."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from page_cases import RecordedLoop, asked, rows_until, served, viewer

from rtctl.border.errors import InputError
from rtctl.cli import main
from rtctl.live_page.served.access import Access
from rtctl.live_page.served.relay import page_relayed, upstream_of
from rtctl.live_page.watching import live_source
from rtctl.session.run_folder import RunFolder


def test_the_command_prints_the_address_serves_and_ends_on_a_signal(tmp_path: Path) -> None:
    RecordedLoop(tmp_path).append(3)
    command = [sys.executable, "-m", "rtctl", "watch", str(tmp_path), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        address = process.stdout.readline().strip()
        assert asked(address)[0] == 200
        assert json.loads(asked(address, "runs")[1]) == {"runs": ["."], "newest": "."}
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=10.0)
    assert process.returncode == 0
    assert (
        said
        == "open it in a browser of this machine (it only shows; --control lets it change the run); Ctrl-C ends it\n"
    )


def test_a_folder_without_a_run_is_said_to_have_none_yet(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "rtctl", "watch", str(tmp_path), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert "nothing is recorded there yet" in process.stderr.readline()
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=10.0)
    assert process.returncode == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["missing"], "missing: there is no run; give the folder of a run"),
        (["file"], "file: is a file; give the folder"),
        (
            ["--live", "missing"],
            "neither the folder of a run, nor its control.sock, nor the address of a page",
        ),
        (["--live", "."], "no run is under way there; rtctl watch"),
        (["--live", "http://127.0.0.1:1/TOKEN/"], "no page is served there: nothing listens"),
        (["--live", "http://127.0.0.1:1"], "the whole address is needed"),
        (["--live", "http://[::"], "--live http://[::"),
        (
            ["--live", "http://127.0.0.1:1/TOKEN/", "--mcap", "x.mcap"],
            "streams are fed where the run is recorded",
        ),
        ([".", "--plotjuggler", "x"], "HOST:PORT is needed"),
        ([".", "--mcap", "x.txt"], "--mcap x.txt: the name must end with .mcap"),
        ([".", "--epics", "a b"], "a prefix of letters, digits and"),
        ([".", "--port", "70000"], "--port 70000: cannot be used"),
    ],
)
def test_what_is_wrong_is_said_without_a_traceback(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    assert main(["watch", *words]) == 2
    assert message in capsys.readouterr().err


def test_a_run_says_how_to_watch_it_once_it_records(tmp_path: Path) -> None:
    said: list[str] = []
    folder = RunFolder(
        path=tmp_path / "my run", metadata={}, model=None, report=said.append, is_announced=True
    )
    assert said == []
    folder.record([("index", "")], [("lateness", "us")]).close()
    assert said == [f"watch it: rtctl watch '{tmp_path}/my run'"]


def test_a_run_under_way_is_named_by_its_folder_or_its_socket(tmp_path: Path) -> None:
    loop = RecordedLoop(tmp_path)
    loop.append(1)
    assert live_source(str(tmp_path)) == tmp_path
    assert live_source(str(tmp_path / "control.sock")) == tmp_path
    loop.end()
    with pytest.raises(InputError, match="no run is under way"):
        live_source(str(tmp_path))


def test_a_page_that_is_served_elsewhere_is_shown_under_a_token_of_its_own(tmp_path: Path) -> None:
    loop = RecordedLoop(tmp_path)
    loop.append(30)
    with (
        served(tmp_path, control=True) as there,
        page_relayed(upstream_of(there.address), Access("here", False), 0) as here,
    ):
        assert asked(here.address)[1] == asked(there.address)[1]
        with viewer(here.address) as events:
            last = rows_until(events, 30)[-1].number
        loop.append(5)
        with viewer(here.address, last) as events:
            assert rows_until(events, 35)[0].content["first"] == 31, "it resumes through the relay, too"
        change = {"method": "POST", "body": '{"name": "stop"}', "Content_Type": "application/json"}
        assert "--control" in asked(here.address, "control", **change)[1]
        assert "no run is under way" in asked(there.address, "control", **change)[1]
        assert asked(f"http://127.0.0.1:{here.server_port}/{there.access.token}/")[0] == 403
    with pytest.raises(InputError, match="token in the address"), served(tmp_path) as again:
        upstream_of(again.address.replace(again.access.token, "another"))
    loop.end()
