"""A request to stop: the caller sets it from anywhere, the diagnosis asks for it between fits."""

from __future__ import annotations


class CancelledError(Exception):
    """Raised between two fits once the caller has cancelled; the pipeline then answers with what is known."""


class CancellationToken:
    """A flag that is set once, by a signal handler or another thread, and read between fits.

    Setting an attribute is atomic, so that no lock is held that a signal handler could find taken.
    """

    def __init__(self) -> None:
        self._cancelled = False

    def cancel(self) -> None:
        """Ask the diagnosis to stop after the fit under way."""
        self._cancelled = True

    @property
    def cancelled(self) -> bool:
        """Whether somebody asked to stop."""
        return self._cancelled

    def raise_if_cancelled(self) -> None:
        """Raise CancelledError if somebody asked to stop."""
        if self._cancelled:
            raise CancelledError
