"""What a terminal, a pipe, a disk or a name does to a command ends in one message at most, never in a traceback."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import rtctl
from rtctl.border.errors import InputError
from rtctl.cli import main

TABLE = "t [s],u [V],x [mm]\n" + "".join(f"{k / 1000},{(k * 7) % 11},{(k * 5) % 13}\n" for k in range(300))


def shell(command: str, folder: Path) -> subprocess.CompletedProcess[bytes]:
    """Run a line of the shell in which `rtctl` is this program."""
    start = f'rtctl() {{ {shlex.quote(sys.executable)} -m rtctl "$@"; }}; {command}'
    return subprocess.run(["bash", "-c", start], cwd=folder, capture_output=True, env=os.environ)


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("rtctl list | head -1 >/dev/null", b""),
        ("rtctl list >&-", b""),
        ("rtctl init r.csv --yes --no-plot --force >&- 2>&-", b""),
        ("rtctl list > /dev/full", b"No space left on device: the output cannot be written"),
        (
            "rtctl init r.csv --yes --no-plot --out new > /dev/full",
            b"No space left on device: the output cannot be written",
        ),
    ],
)
def test_a_closed_or_full_stream_is_no_traceback(tmp_path: Path, command: str, said: bytes) -> None:
    (tmp_path / "r.csv").write_text(TABLE)
    done = shell(command, tmp_path)
    assert b"Traceback" not in done.stderr
    assert b"Exception" not in done.stderr
    assert said in done.stderr


def test_what_the_encoding_of_the_output_lacks_is_a_question_mark(tmp_path: Path) -> None:
    done = shell("PYTHONIOENCODING=latin-1 rtctl list; PYTHONIOENCODING=ascii rtctl list", tmp_path)
    assert (done.returncode, done.stderr) == (0, b"")


def test_a_pipe_or_a_device_is_not_replaced_by_a_file(tmp_path: Path) -> None:
    """As the superuser `--out /dev/full` had put a picture in the place of the device."""
    (tmp_path / "r.csv").write_text(TABLE)
    os.mkfifo(tmp_path / "pipe")
    done = shell("rtctl init r.csv --yes --no-plot && rtctl preview dataset.toml --out pipe", tmp_path)
    assert done.returncode == 2
    assert b"is a device, a pipe or a socket" in done.stderr
    assert (tmp_path / "pipe").is_fifo()


def test_a_command_whose_output_is_closed_does_its_work(tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text(TABLE)
    assert shell("rtctl init r.csv --yes --no-plot >&- 2>&-", tmp_path).returncode == 0
    assert len(rtctl.read_dataset(tmp_path / "dataset.toml").records) == 2


def test_a_full_disk_is_one_message_with_the_file_and_leaves_no_part_of_it(tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text(TABLE)
    done = shell("trap '' XFSZ; ulimit -f 0; rtctl init r.csv --yes --no-plot --out new", tmp_path)
    assert done.returncode == 1
    assert done.stderr.decode().strip() == (
        "rtctl init: new/dataset.toml: File too large; free some space, or write elsewhere with --out"
    )
    assert list((tmp_path / "new").iterdir()) == []


def test_a_disk_without_room_for_a_recording_is_said_with_its_folder(tmp_path: Path) -> None:
    done = shell("trap '' XFSZ; ulimit -f 200; rtctl run me_amplitude --out new --no-plot", tmp_path)
    said = done.stderr.decode().strip().splitlines()[-1]
    assert done.returncode == 1
    assert said.startswith("rtctl run: new")
    assert said.endswith("; free some space, or write elsewhere with --out")


@pytest.mark.parametrize(
    "words",
    [
        ["init", "m\udce4.csv", "--yes"],
        ["init", "r.csv", "--yes", "--out", "o\udcff"],
        ["identify", "dataset.toml", "--out", "\udcff/model.toml"],
    ],
)
def test_a_name_that_is_no_utf_8_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    said = capsys.readouterr().err
    assert "the name is not UTF-8; rename it, or choose another" in said
    assert "\\udc" in said
    assert list(tmp_path.iterdir()) == []


def test_python_refuses_such_a_name_as_well(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not UTF-8"):
        rtctl.init(tmp_path / "m\udce4.csv")


@pytest.mark.parametrize("goal", ["loop.csv", "gone.csv"])
def test_a_link_that_leads_to_no_file_is_one_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], goal: str
) -> None:
    link = tmp_path / "loop.csv"
    link.symlink_to(goal)
    assert main(["init", str(link), "--yes"]) == 2
    said = capsys.readouterr().err
    assert said == (
        f"rtctl init: {link}: is a symbolic link to {goal}, which leads to no file; correct the link, or name the "
        "file\n"
    )


def test_a_pipe_is_no_data_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(tmp_path / "r.csv")
    assert main(["init", str(tmp_path / "r.csv"), "--yes"]) == 2
    said = capsys.readouterr().err
    assert f"{tmp_path / 'r.csv'}: is a pipe, a socket or a device, a file is needed" in said
    assert "such as new_r.csv, and name that" in said
