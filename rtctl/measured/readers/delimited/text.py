"""Bytes of a text file as UTF-8 lines: the file itself, or a copy in memory where it is packed or written otherwise."""

from __future__ import annotations

import codecs
import gzip
import io
import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np
import pyarrow as pa

from rtctl.measured.readers.stated.preamble import NumberedLine

BLOCK_BYTES = 1 << 18
LARGEST_COPY = 1 << 30
"""Bytes of a copy in memory; larger files have to be plain ones."""
_LF, _CR, _QUOTE, _BLANK, _TAB = b'\n\r" \t'
_LINE_END = re.compile(rb"\r\n|\n|\r")
_GZIP = b"\x1f\x8b"
_WIDE_MARKS = {
    codecs.BOM_UTF32_LE: "utf-32-le",
    codecs.BOM_UTF32_BE: "utf-32-be",
    codecs.BOM_UTF16_LE: "utf-16-le",
    codecs.BOM_UTF16_BE: "utf-16-be",
}


class Line(NamedTuple):
    """Where a line starts; blank lines do not count."""

    number: int
    byte: int


class Lines(NamedTuple):
    """The lines of a text."""

    written: int
    """Number of lines that are not blank."""
    places: list[Line]
    """The first line of each block of the text."""
    only_blanks: bool
    """Whether a line has nothing but blanks, which a reader of numbers takes as a short row."""


@dataclass(frozen=True, slots=True)
class Text:
    """A text in UTF-8 (or Latin-1, outside of its numbers): a file, or a copy in memory."""

    path: Path
    copy: bytes | None = None

    @contextmanager
    def opened(self) -> Iterator[IO[bytes]]:
        """Yield the text as a file."""
        if self.copy is not None:
            yield io.BytesIO(self.copy)
            return
        with self.path.open("rb") as file:
            yield file

    @contextmanager
    def source(self) -> Iterator[pa.NativeFile]:
        """Yield the text as a file of pyarrow's."""
        if self.copy is not None:
            yield pa.BufferReader(self.copy)
            return
        with pa.OSFile(str(self.path)) as file:
            yield file

    def whole(self) -> bytes:
        """Return all bytes. Raises ValueError where they are too many for a copy."""
        if self.copy is not None:
            return self.copy
        if self.path.stat().st_size > LARGEST_COPY:
            raise ValueError(f"is larger than {LARGEST_COPY >> 20} MB and not plain CSV in UTF-8; convert it")
        return self.path.read_bytes()

    def without_blank_lines(self) -> Text:
        """Return a copy whose lines that have blanks only are empty, so that the others keep their numbers."""
        return Text(self.path, re.sub(rb"(?m)^[ \t]+(?=\r?(\n|\Z))", b"", self.whole()))

    def with_tabs(self) -> Text:
        """Return a copy whose columns, separated by any blanks, are separated by one tab."""
        lines = (b"\t".join(line.split()) for line in self.whole().splitlines())
        text = b"\n".join(lines)
        return Text(self.path, text + b"\n" if self.whole()[-1:] in (b"\n", b"\r") else text)

    def opening(self, lines: int) -> list[NumberedLine]:
        """Return the first lines that are not blank, without their ends. Raises ValueError for a line without end."""
        found: list[NumberedLine] = []
        count = 0
        with self.opened() as file:
            while len(found) < lines and (raw := file.readline(BLOCK_BYTES)):
                if len(raw) == BLOCK_BYTES and not _LINE_END.search(raw):
                    raise ValueError(too_long(count + 1))
                parts = [_decoded(part) for part in raw.splitlines()]  # ends may be CR only
                found += [NumberedLine(k, part) for k, part in enumerate(parts, count + 1) if part.strip()]
                count += len(parts)
        if found:
            found[0] = found[0]._replace(text=found[0].text.removeprefix("\ufeff"))
        return found[:lines]

    def lines_until(self, head: int) -> int:
        """Return the number of lines, those of blanks and tabs counted, up to the `head`-th that has more."""
        written = seen = 0
        with self.opened() as file:
            while seen < head and (block := file.readline(BLOCK_BYTES)):
                for part in block.splitlines():
                    if seen < head and part:
                        written, seen = written + 1, seen + bool(part.strip())
        return written

    def too_long_line(self) -> int:
        """Return the number, from 1, of the first line that is longer than a block; 0: none is."""
        count = held = 0
        with self.opened() as file:
            while block := file.read(BLOCK_BYTES):
                *ended, last = _LINE_END.split(block)
                for k, part in enumerate(ended):
                    if len(part) + (held if k == 0 else 0) > BLOCK_BYTES:
                        return count + 1
                    count += 1
                held = len(last) + (0 if ended else held)
                if held > BLOCK_BYTES:
                    return count + 1
        return 0

    def line_number(self, last: int) -> int:
        """Return the number, from 1, of the line that is the `last`-th from the end of those that are not blank."""
        written = [k for k, line in enumerate(self.whole().splitlines(), 1) if line.strip()]
        return written[-last]

    def size(self) -> int:
        """Return the number of bytes."""
        return self.path.stat().st_size if self.copy is None else len(self.copy)

    def tail(self) -> bytes:
        """Return the last bytes, at most a block."""
        with self.opened() as file:
            size = file.seek(0, 2)
            file.seek(max(size - BLOCK_BYTES, 0))
            return file.read()


def open_text(path: Path) -> Text:
    """Return the text of a file that may be packed (gzip) or in UTF-16 or UTF-32. Raises ValueError in words."""
    with path.open("rb") as file:
        head = file.read(512)
    if head.startswith(_GZIP):
        copy = _unpacked(path)
        head = copy[:512]
    else:
        copy = None
    wide = _wide_encoding(head)
    if wide is None:
        return Text(path, copy)
    raw = Text(path, copy).whole()
    try:
        return Text(path, raw.decode(wide).removeprefix("\ufeff").encode())
    except UnicodeDecodeError:
        raise ValueError(
            f"is cut off or damaged: it begins as {wide.upper()} and does not go on so"
        ) from None


def index_lines(text: Text, head: int = 0) -> Lines:
    """Return the number of non-blank lines, and in each block of the text the first of them from line `head` on.

    Lines end with LF, CR LF or CR; the last may lack its end. Raises ValueError for a line break inside quotes.
    """
    count, offset, after_end, in_quotes, only_blanks = 0, 0, True, False, False
    index: list[Line] = []
    with text.opened() as file:
        while block := file.read(BLOCK_BYTES):
            codes = np.frombuffer(block, np.uint8)
            ends = (codes == _LF) | (codes == _CR)
            starts = np.flatnonzero(~ends & np.concatenate([[after_end], ends[:-1]]))
            if in_quotes or b'"' in block:
                quotes = codes == _QUOTE
                above = head - 1 - count  # where the last line of the head begins in this block
                if above >= 0:  # a title may have a lone one: 6" is six inches
                    quotes[: starts[above] if above < len(starts) else None] = False
                inside = (np.cumsum(quotes) + in_quotes) % 2 == 1
                if (broken := np.flatnonzero(inside & ends)).size:
                    raise ValueError(_about_quote(text, offset + int(broken[0])))
                in_quotes = bool(inside[-1])
            only_blanks = only_blanks or _has_blank_line(block, codes, starts)
            if count + len(starts) > head:
                k = max(head - count, 0)
                index.append(Line(count + k, offset + int(starts[k])) if k < len(starts) else index[-1])
            count, offset, after_end = count + len(starts), offset + len(block), bool(ends[-1])
    return Lines(count, index, only_blanks)


def _about_quote(text: Text, end: int) -> str:
    """Return the message about a quote that is open where a line ends, at byte `end`."""
    with text.opened() as file:
        number = len(file.read(end).splitlines())
    return f"line {number}: a line break stands inside quotes, or a quote is not closed; remove it"


def too_long(number: int) -> str:
    """Return the message about a line, counted from 1, that is longer than a block."""
    return (
        f"line {number} is longer than {BLOCK_BYTES >> 10} kB, the most that a row may have: it is damaged or holds a "
        "long text (correct or remove the line), or a whole signal stands in it (write each signal as a column)"
    )


_ONLY_BLANKS = re.compile(rb"[ \t]+(?=[\r\n]|\Z)")


def _has_blank_line(block: bytes, codes: np.ndarray[tuple[int], np.dtype[np.uint8]], starts: object) -> bool:
    first = np.asarray(starts)
    candidates = first[(codes[first] == _BLANK) | (codes[first] == _TAB)]
    return any(_ONLY_BLANKS.match(block, int(start)) for start in candidates)


def _decoded(line: bytes) -> str:
    try:
        return line.decode()
    except UnicodeDecodeError:
        return line.decode("latin-1")


def _wide_encoding(head: bytes) -> str | None:
    """Return the encoding of a text of characters of two or four bytes, by its mark or by the zeros in it."""
    for mark, name in _WIDE_MARKS.items():
        if head.startswith(mark):
            return name
    pairs = len(head) // 2
    if pairs < 2:
        return None
    low, high = head[0 : 2 * pairs : 2].count(0), head[1 : 2 * pairs : 2].count(0)
    fourths = [head[k : 4 * (len(head) // 4) : 4].count(0) for k in range(4)]
    if pairs >= 4 and fourths[1] == fourths[2] == len(head) // 4 and not (fourths[0] and fourths[3]):
        return "utf-32-be" if fourths[0] else "utf-32-le"
    return "utf-16-le" if high == pairs and not low else "utf-16-be" if low == pairs and not high else None


def _unpacked(path: Path) -> bytes:
    try:
        with gzip.open(path) as file:
            copy = file.read(LARGEST_COPY + 1)
    except EOFError:
        raise ValueError("is cut off: the packed file does not have its end; copy it again") from None
    except (OSError, zlib.error) as error:
        raise ValueError(f"not readable as gzip, or damaged: {error}") from None
    if len(copy) > LARGEST_COPY:
        raise ValueError(
            f"holds more than {LARGEST_COPY >> 20} MB when it is unpacked; unpack it to a plain file"
        )
    if not copy:
        raise ValueError("the file is empty (0 bytes); copy or export it again")
    return copy
