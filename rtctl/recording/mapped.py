"""A recorder into a mapped file: a row is one pack into memory that the kernel owns, so it outlives the process.

The file is mapped in windows. The next one is allocated, mapped and written to once by a helper thread while the loop
fills the present one, so the loop meets neither a page fault of a new page nor the file system's search for room.
"""

from __future__ import annotations

import ctypes
import fcntl
import mmap
import os
import struct
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.recording.layout import PAGE, Rows, header_bytes, stride_of
from rtctl.recording.rows import Columns

WINDOW_ROWS = 4096
_POPULATE_WRITE = 23  # MADV_POPULATE_WRITE, Linux 5.14

Window = tuple[int, mmap.mmap]
"""The number of a window, and its memory."""


class Keeper:
    """A thread for what the loop must not wait for; started before the loop asks for real time."""

    def __init__(self) -> None:
        self._wanted: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._keep, name="recording", daemon=True)
        self._thread.start()
        self.ask = self._wanted.put
        """`ask(work)`: do it soon; costs the asker a tenth of a microsecond."""

    def _keep(self) -> None:
        while (work := self._wanted.get()) is not None:
            work()

    def close(self) -> None:
        """Finish what was asked for."""
        self._wanted.put(None)
        self._thread.join()


class MappedRecorder:
    """A `SignalRecorder` into `path`, readable by `Rows` at any moment, also after a kill."""

    def __init__(self, path: Path, columns: Columns, metadata: Mapping[str, str], keeper: Keeper) -> None:
        """Replace an old file at `path`. Raises InputError if another run is recording into it."""
        names = [name for name, _ in columns]
        if len(set(names)) != len(names) or not names:
            raise ValueError(f"column names must differ, got {names}")
        self.columns = list(columns)
        self.path = path
        self.waits = 0
        """Windows that were not ready in time, which the loop had to make itself."""
        native = (
            "@" if sys.byteorder == "little" else "<"
        )  # the same bytes; native doubles are copied, not converted
        self._pack = struct.Struct(f"{native}{len(names)}dQ").pack_into
        self._stride = stride_of(len(names))
        self._window_bytes = WINDOW_ROWS * self._stride
        self._keeper = keeper
        self._file = _locked_file(path)
        header = header_bytes(self.columns, metadata)
        os.write(self._file, header)
        self._begin = len(header)
        self._count = self._offset = 0
        self._number, self._window = self._made(0)
        self._next: Window | None = self._made(1)

    def append(self, row: tuple[float, ...]) -> None:
        """Append one row, in the order of the columns. Raises ValueError on another number of values."""
        offset = self._offset
        if offset == self._window_bytes:
            self._turn()
            offset = 0
        count = self._count + 1
        try:
            self._pack(self._window, offset, *row, count)
        except struct.error as error:
            raise ValueError(f"a row of {len(row)} values for {len(self.columns)} columns: {error}") from None
        self._count = count
        self._offset = offset + self._stride

    def ahead(self, most: int) -> FloatArray:
        """Return room (rows, columns + 1) for the next rows, to be written in place; then call `advance`.

        Behind its columns a row has its number, as uint64; write it last. Let go of the room before the next call.
        `most` rows are returned at most.
        """
        if self._offset == self._window_bytes:
            self._turn()
        rows = min(most, (self._window_bytes - self._offset) // self._stride)
        width = len(self.columns) + 1
        room = np.frombuffer(self._window, count=rows * width, offset=self._offset)
        return room.reshape(rows, width)

    def advance(self, rows: int) -> None:
        """Take so many rows of `ahead` as written."""
        self._count += rows
        self._offset += rows * self._stride

    def __len__(self) -> int:
        return self._count

    def close(self) -> Rows:
        """End the recording: the file is as long as its rows, which can now be read."""
        self._keeper.close()
        for window in (self._window, *([] if self._next is None else [self._next[1]])):
            with suppress(BufferError):  # a fault has kept a view of it
                window.close()
        os.ftruncate(self._file, self._begin + self._count * self._stride)
        os.close(self._file)
        return Rows(self.path)

    def _turn(self) -> None:
        """Turn to the next window; the keeper lets go of the old one and makes the one after."""
        number, old = self._number + 1, self._window
        ready, self._next = self._next, None
        if ready is None or ready[0] != number:
            self.waits += 1
            try:
                ready = self._made(number)
            except OSError as error:
                raise DriverError(
                    Fault.RECORDING,
                    f"{self.path}: no room for more rows: {error.strerror}; what is there stays whole",
                ) from None
        self._number, self._window = ready
        self._offset = 0
        self._keeper.ask(lambda: self._prepare(number + 1, old))

    def _prepare(self, number: int, old: mmap.mmap) -> None:
        with suppress(BufferError):
            old.close()
        with suppress(OSError):  # a full disk: the loop finds out when it needs the room
            self._next = self._made(number)

    def _made(self, number: int) -> Window:
        begin = self._begin + number * self._window_bytes
        os.posix_fallocate(self._file, begin, self._window_bytes)
        window = mmap.mmap(self._file, self._window_bytes, offset=begin)
        _touch(window)
        return number, window


def _touch(window: mmap.mmap) -> None:
    """Make every page present and writable, without the interpreter's lock, unlike mmap's own methods."""
    view = (ctypes.c_char * len(window)).from_buffer(window)
    ctypes.CDLL(None).madvise(
        ctypes.c_void_p(ctypes.addressof(view)), ctypes.c_size_t(len(window)), _POPULATE_WRITE
    )  # a kernel that does not know it lets the loop meet the faults: slower, not wrong


def _locked_file(path: Path) -> int:
    """Open the file, empty, and lock it for this process."""
    path.parent.mkdir(parents=True, exist_ok=True)
    number = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(number)
        raise InputError(f"{path}: another run is recording here; give --out another folder") from None
    os.ftruncate(number, 0)
    return number


assert WINDOW_ROWS * 8 % PAGE == 0  # windows begin on pages whatever the columns
