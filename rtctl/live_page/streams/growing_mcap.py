"""An MCAP file that grows and is whole between writes: index and footer are written anew behind the settled part.

    [magic, header, closed chunks ...] settled | [open chunk, its index, data end, summary, footer] anew each time

A reader such as PlotJuggler's wants the summary at the end of the file and opens no file without it, so a recorder that
was killed must have left one. Killed in the millisecond of a write it leaves a file for `mcap recover`, of MCAP's own
program. Chunks that are full (1 MiB before compression) are settled and never touched again.
Reference: MCAP format specification, https://mcap.dev/spec.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from rtctl.extras import require
from rtctl.output.own_files import mark_of


class Topic(NamedTuple):
    """A kind of message."""

    name: str
    schema: str
    """Name of its schema."""
    properties: Mapping[str, Mapping[str, Any]]
    """JSON schema of each field of a message."""


class _Output:
    """What the writer writes to: bytes behind the settled part, in memory until they are saved."""

    def __init__(self) -> None:
        self.settled = 0
        self.pending = bytearray()

    def write(self, data: bytes) -> int:
        self.pending += data
        return len(data)

    def tell(self) -> int:
        return self.settled + len(self.pending)

    def flush(self) -> None:
        """Keep it: `GrowingMcap.save` writes."""


class GrowingMcap:
    """The file; nothing is on the disk before `save`."""

    def __init__(self, path: Path) -> None:
        """Begin a file at `path` in place of an old one. Raises OSError, InputError where mcap is missing."""
        require("mcap", "writing .mcap")
        from mcap.writer import Writer

        self._file = path.open("wb", buffering=0)  # a buffer that cannot be written is in the way of closing
        self._output = _Output()
        self._writer = Writer(self._output)  # type: ignore[arg-type] # it needs write, tell and flush only
        self._writer.start(library=mark_of("export mcap"))
        self._channels: dict[str, int] = {}

    def register(self, topic: Topic) -> None:
        """Add a kind of message."""
        schema = {"title": topic.schema, "type": "object", "properties": topic.properties}
        number = self._writer.register_schema(topic.schema, "jsonschema", json.dumps(schema).encode())
        self._channels[topic.name] = self._writer.register_channel(topic.name, "json", number)

    def add(self, topic: str, time_ns: int, message: Mapping[str, Any], number: int = 0) -> None:
        """Add a message.

        Args:
            topic: Name of a registered topic.
            time_ns: When, in the run [ns].
            message: Its fields; no NaN, which JSON does not have.
            number: Its number in the recording, from 1; 0: it has none.
        """
        data = json.dumps(message, allow_nan=False).encode()
        self._writer.add_message(self._channels[topic], time_ns, data, time_ns, number)

    def attach(self, name: str, kind: str, content: bytes) -> None:
        """Add a whole file under its name, with its media type."""
        self._writer.add_attachment(0, 0, name, kind, content)

    def describe(self, name: str, words: Mapping[str, str]) -> None:
        """Add metadata of the whole file."""
        self._writer.add_metadata(name, dict(words))

    def save(self) -> None:
        """Bring the file up to date: whole, with an index, as if it ended here. Raises OSError."""
        writer, output = copy.deepcopy((self._writer, self._output))  # the copy writes to the copied output
        writer.finish()  # type: ignore[no-untyped-call]
        self._file.seek(self._output.settled)
        left = memoryview(output.pending)
        while left:
            left = left[self._file.write(left) :]
        self._file.truncate()
        self._output.settled += len(self._output.pending)
        self._output.pending.clear()

    def close(self) -> None:
        """Close the file as it was saved last."""
        self._file.close()
