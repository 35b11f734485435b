"""Cases of one target in a child process with limits, which is watched from outside: a crash or a hang costs one case.

Case k of a target and a seed is always the same. What is counted: tracebacks (an error that is no message), crashes
(the process died), hangs (longer than `LONGEST_S`), files (written or removed outside of the case's folder).
"""

from __future__ import annotations

import faulthandler
import json
import mmap
import os
import random
import resource
import shutil
import signal
import struct
import sys
import tempfile
import time
import traceback
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fuzz_targets import Case, Target

__all__ = ["Case", "Outcome", "run"]

MEMORY_BYTES = 2 << 30
"""Memory of a case, beyond what the program takes to start."""
LONGEST_S = 10.0
"""Time of a case on an idle machine; on a busy one as many times more as processes share a core."""
_POLL_S = 0.05
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC


@dataclass(slots=True)
class Outcome:
    """What came of the cases of a target."""

    target: str
    inputs: int = 0
    refused: int = 0
    """Inputs that ended in a message; the others were read."""
    found: list[dict[str, Any]] = field(default_factory=list)
    """Findings: kind, case and text."""

    def counts(self) -> Counter[str]:
        """Return the findings by kind."""
        return Counter(one["kind"] for one in self.found)


def run(name: str, target: Target, seed: int, cases: range, seconds: float = float("inf")) -> Outcome:
    """Run the cases of a target, at most so many seconds; a child that dies or hangs is replaced."""
    target.prepare()
    outcome, at, end = Outcome(name), cases.start, time.monotonic() + seconds
    while at < cases.stop and time.monotonic() < end:
        at = _child(outcome, target, seed, range(at, cases.stop), end)
    outcome.inputs = at - cases.start
    return outcome


def _child(outcome: Outcome, target: Target, seed: int, cases: range, end: float) -> int:
    """Run cases in a child until they are done or it ends; return the case to go on with."""
    shared = mmap.mmap(-1, 16)  # the case under way; how many were refused
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder, tempfile.TemporaryFile("w+") as found:
        process = os.fork()
        if process == 0:
            try:
                _work(shared, found, outcome.target, target, seed, cases, Path(folder))
            finally:
                os._exit(0)
        ended = _watch(process, shared, end)
        at, refused = struct.unpack("<qq", shared)
        outcome.refused += refused
        found.seek(0)
        outcome.found += [json.loads(line) for line in found]
        if ended:
            outcome.found.append({"kind": ended.partition(" ")[0], "case": at, "text": ended})
            at += 1
    return at


def _watch(process: int, shared: mmap.mmap, end: float) -> str:
    """Wait for a child; return why it ended before its time, "" if it did not."""
    seen, since = -1, time.monotonic()
    while True:
        done, status = os.waitpid(process, os.WNOHANG)
        if done:
            if os.WIFSIGNALED(status):
                return f"crash by {signal.Signals(os.WTERMSIG(status)).name}"
            return ""
        (at, _), now = struct.unpack("<qq", shared), time.monotonic()
        if at != seen:
            seen, since = at, now
        late = now - since > LONGEST_S * max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))
        if late or now > end:
            os.kill(process, signal.SIGKILL)
            os.waitpid(process, 0)
            return f"hang of more than {LONGEST_S:g} s" if late else ""
        time.sleep(_POLL_S)


def _work(
    shared: mmap.mmap, found: Any, name: str, target: Target, seed: int, cases: range, folder: Path
) -> None:
    limit = _virtual_bytes() + MEMORY_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    faulthandler.disable()  # a crash is told by the process that watches
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # what libraries say of damaged files
    allowed, strange = folder / "case", list[str]()
    _forbid_files(allowed, strange)
    refused = 0
    for k in cases:
        shared[:] = struct.pack("<qq", k, refused)
        strange.clear()
        allowed.mkdir(exist_ok=True)
        os.chdir(allowed)
        kind, text = _one(name, target, seed, k, allowed)
        refused += kind == "refused"
        if strange:
            kind, text = "files", "; ".join(strange[:5])
        if kind not in ("", "refused"):
            found.write(json.dumps({"kind": kind, "case": k, "text": text}) + "\n")
            found.flush()
        os.chdir(folder)
        for left in allowed.iterdir():
            shutil.rmtree(left) if left.is_dir() else left.unlink()
    shared[:] = struct.pack("<qq", cases.stop, refused)


def _one(name: str, target: Target, seed: int, k: int, folder: Path) -> tuple[str, str]:
    try:
        target.case(random.Random(f"{seed}/{name}/{k}"), folder)
    except target.messages as error:
        return (
            ("refused", "") if str(error).strip() else ("traceback", f"{type(error).__name__} without words")
        )
    except Exception:
        return "traceback", traceback.format_exc(limit=-6)
    return "", ""


def _forbid_files(allowed: Path, strange: list[str]) -> None:
    """Note every file that Python opens for writing, makes, moves or removes outside of a folder."""

    def note(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            written = isinstance(arguments[2], int) and arguments[2] & _WRITING
            paths = arguments[:1] if written else ()
        elif event in ("os.remove", "os.mkdir", "os.rmdir", "os.truncate"):
            paths = arguments[:1]
        elif event in ("os.rename", "os.link", "os.symlink"):
            paths = arguments[:2]
        else:
            return
        for path in paths:
            if isinstance(path, str | bytes) and not _is_within(os.fsdecode(path), allowed):
                strange.append(f"{event} {os.fsdecode(path)}")

    sys.addaudithook(note)


def _is_within(path: str, folder: Path) -> bool:
    full = os.path.abspath(path)
    own = full == str(folder) or full.startswith(f"{folder}{os.sep}")
    return own or full in ("/dev/null",) or "__pycache__" in full


def _virtual_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
