"""Collected findings about a manifest and its files, so that a user corrects them in one go."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rtctl.border.errors import InputError


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
        """Raise InputError with every message, one a line, if there is one."""
        if self._lines:
            raise InputError("\n".join(self._lines))
