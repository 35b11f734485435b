"""Files read in a process of its own with limits: what crashes a library, or never ends in it, ends in one message.

The HDF5 library and SciPy's reader of MATLAB 5 are compiled code that believes a file: damaged ones end in a
segmentation fault or an endless loop. One child process (`child`) serves all such files of a process: it gets
memory up to what is free when it starts, and processor time by the size of what is read. It ends with its parent,
whose end closes its input.
"""

from __future__ import annotations

import atexit
import os
import pickle
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from math import prod
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.measured.readers.groups import Place
from rtctl.measured.readers.stated.beside import Level
from rtctl.measured.readers.table import Column, Header, Table

CHILD = "rtctl.measured.readers.limits.child"
CPU_S, CPU_BYTES_PER_S = 3.0, 1e7
"""Processor time of a request: so much, and one second more for so many bytes of the file and of the numbers."""


DONE, REFUSED, FAILED = range(3)
"""Kinds of answers: a result, the words of a ValueError, the traceback of a fault in our own code."""
NO_MEMORY = "needs more memory than there is, or is damaged; take a part of it, or save it again"


class ReaderEndedError(ValueError):
    """The child ended while it read."""


class Opening(NamedTuple):
    """Answer to a request to open a file: a `Table` without its function."""

    columns: dict[str, Header]
    piecewise: bool
    remarks: tuple[str, ...]
    places: dict[str, Place]
    texts: dict[str, str]
    beside: dict[str, Level]


class Request(NamedTuple):
    """What the child is asked: the columns of a file, or rows [first, end) of one of them."""

    module: str
    path: Path
    cpu_s: float
    """Processor time after which the child is ended [s]."""
    column: str = ""
    """"": the columns."""
    first: int = 0
    end: int = 0


def read(module: str, path: Path) -> Table:
    """Return the columns of a file by the reader `module`, which runs in the child. Raises ValueError in words."""
    path = Path(os.path.abspath(path))
    file_bytes = path.stat().st_size
    ended: list[str] = []
    opened: Opening = _CHILD.answer(Request(module, path, _cpu_s(file_bytes)))

    def load(name: str, first: int, end: int) -> Column:
        if ended:  # once is enough: each further column would take as long, and end alike
            raise ValueError(ended[0])
        numbers = end - first if opened.piecewise else prod(opened.columns[name].shape)
        request = Request(module, path, _cpu_s(file_bytes + 8 * numbers), name, first, end)
        try:
            return np.asarray(_CHILD.answer(request))
        except ReaderEndedError as error:
            ended.append(str(error))
            raise

    return Table(
        columns=opened.columns,
        load=load,
        piecewise=opened.piecewise,
        remarks=opened.remarks,
        places=opened.places,
        texts=opened.texts,
        beside=opened.beside,
    )


def _cpu_s(read_bytes: int) -> float:
    return CPU_S + read_bytes / CPU_BYTES_PER_S


class _Child:
    """The child process of this process, started at the first request and again after it has died."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._owner = 0

    def answer(self, request: Request) -> Any:
        """Return the child's answer. Raises ValueError with its words, or with how it ended."""
        with self._lock:
            process = self._started()
            assert process.stdin is not None
            assert process.stdout is not None
            try:
                pickle.dump(request, process.stdin)
                process.stdin.flush()
                kind, answer = pickle.load(process.stdout)
            except (EOFError, BrokenPipeError, pickle.UnpicklingError):
                status = process.wait()
                self.end()
                raise ReaderEndedError(_ended(status)) from None
            except BaseException:  # Ctrl-C between question and answer: the next one must not get this answer
                self.end()
                raise
        if kind == REFUSED:
            raise ValueError(answer)
        if kind == FAILED:
            raise RuntimeError(answer)
        return answer

    def end(self) -> None:
        """End the child, if this process has one."""
        if self._process is not None and self._owner == os.getpid():
            self._process.kill()
            self._process.wait()
            for stream in (self._process.stdin, self._process.stdout):
                if stream is not None:
                    with suppress(BrokenPipeError):  # part of a request that nobody reads any more
                        stream.close()
        self._process = None

    def _started(self) -> subprocess.Popen[bytes]:
        if self._owner != os.getpid():  # divided from a process that keeps its own
            self._process = None
        if self._process is not None and self._process.poll() is not None:
            self.end()
        if self._process is None:
            self._owner = os.getpid()
            places = os.pathsep.join(place for place in sys.path if place)
            self._process = subprocess.Popen(
                [sys.executable, "-m", CHILD],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env={**os.environ, "PYTHONPATH": places},
                start_new_session=True,  # Ctrl-C is the parent's
            )
        return self._process


_CHILD = _Child()
atexit.register(_CHILD.end)


def _ended(status: int) -> str:
    if -status == signal.SIGXCPU:
        return "is damaged: its library does not come to an end with it; copy or save it again"
    if -status == signal.SIGKILL:
        return NO_MEMORY
    how = signal.Signals(-status).name if status < 0 else f"exit code {status}"
    return f"is damaged: its library crashed on it ({how}); copy or save it again"
