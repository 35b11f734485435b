"""A file on which a library crashes, never ends or fills memory is one message, and the next file is read."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from rtctl.measured.readers.limits import limited
from rtctl.measured.readers.table import Table


def table(folder: Path, word: str) -> Table:
    path = folder / f"{word}.mat"
    path.write_text(word)
    return limited.read("reader_that_fails", path)


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("crash", r"is damaged: its library crashed on it \(SIGSEGV\)"),
        ("loop", "does not come to an end"),
        ("memory", "needs more memory than there is"),
    ],
)
def test_what_kills_a_reader_is_one_message_and_the_next_file_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, word: str, message: str
) -> None:
    monkeypatch.setattr(limited, "CPU_S", 0.1)
    with pytest.raises(ValueError, match=message):
        table(tmp_path, word)
    monkeypatch.undo()
    np.testing.assert_array_equal(table(tmp_path, "good").load("a", 2, 5), [2, 3, 4])


def test_a_file_may_also_kill_its_reader_late(tmp_path: Path) -> None:
    late = table(tmp_path, "late")
    good = table(tmp_path, "good")
    with pytest.raises(ValueError, match="SIGBUS"):
        late.load("a", 0, 9)
    with pytest.raises(ValueError, match="SIGBUS"):
        late.load("a", 0, 9)
    assert len(good.load("a", 0, 9)) == 9, "a file that was opened before the crash is not read any more"


def test_threads_do_not_take_each_other_s_answers(tmp_path: Path) -> None:
    good = table(tmp_path, "good")
    wrong: list[int] = []

    def ask() -> None:
        wrong.extend(k for k in range(9) if good.load("a", k, 9)[0] != k)

    threads = [threading.Thread(target=ask) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


_SCRIPT = """
import os, signal, sys
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from rtctl.measured.readers.limits import limited
good = limited.read("reader_that_fails", Path(sys.argv[1]))
process = os.fork()
if process == 0:
    os._exit(int(good.load("a", 3, 4)[0]) + 40)
print(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), int(good.load("a", 5, 6)[0]))
print(limited._CHILD._process.pid, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_divided_process_has_a_reader_of_its_own_and_none_outlives_a_killed_program(tmp_path: Path) -> None:
    (tmp_path / "good.mat").write_text("good")
    done = subprocess.run(
        [sys.executable, "-c", _SCRIPT, str(tmp_path / "good.mat"), str(Path(__file__).parent)],
        capture_output=True,
        text=True,
    )
    assert done.returncode == -signal.SIGKILL, done.stderr
    read, reader = done.stdout.splitlines()
    assert read == "43 5"
    end = time.monotonic() + 10.0
    while Path(f"/proc/{int(reader)}").exists():
        assert time.monotonic() < end, "the reader's process outlives a killed parent"
        time.sleep(0.02)
