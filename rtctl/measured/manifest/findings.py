"""Collected findings about a manifest and its files, so that a user corrects them in one go."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from rtctl.border.errors import InputError

_PLACE = re.compile(r'records\.\d+ "[^"]*": ')


class Findings:
    """Messages about one source. A failed block adds its message and the reading goes on."""

    def __init__(self, source: str) -> None:
        self.source = source
        self._lines: dict[str, None] = {}  # ordered, and each message once
        self._remarks: dict[str, None] = {}

    @property
    def lines(self) -> tuple[str, ...]:
        """Return all messages so far."""
        return tuple(self._lines)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Return what a user must know though the files can be read."""
        return tuple(self._remarks)

    def remark(self, text: str) -> None:
        """Add one remark, without the source."""
        self._remarks[text] = None

    def add(self, message: str) -> None:
        """Add one message, without the source."""
        self._lines[f"{self.source}: {message}"] = None

    @contextmanager
    def under(self, where: str) -> Iterator[None]:
        """Turn a ValueError or InputError in the block into a finding about `where`."""
        try:
            yield
        except (ValueError, InputError) as error:
            self.add(f"{where}: {error}")

    def raise_all(self) -> None:
        """Raise InputError with every message, one a line, if there is one; what several records share, once."""
        if self._lines:
            raise InputError("\n".join(_shared_once(self._lines)))


def _shared_once(lines: Iterable[str]) -> Iterator[str]:
    """Yield the lines; of those that differ in the record alone the first one, and how many more there are."""
    groups: dict[str, list[str]] = {}
    for line in lines:
        groups.setdefault(_PLACE.sub("records: ", line, count=1), []).append(line)
    for first, *more in groups.values():
        yield f"{first} (the same in {len(more)} more record{'s' * (len(more) > 1)})" if more else first
