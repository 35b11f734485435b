"""A token is cancelled once and for all, from a signal handler or another thread."""

from __future__ import annotations

import os
import signal
import threading

import pytest

from rtctl.diagnosis.problem.cancellation import CancellationToken, CancelledError


def test_a_token_raises_from_the_moment_it_is_cancelled() -> None:
    token = CancellationToken()
    token.raise_if_cancelled()
    assert not token.cancelled
    token.cancel()
    token.cancel()
    assert token.cancelled
    with pytest.raises(CancelledError):
        token.raise_if_cancelled()


def test_another_thread_may_cancel() -> None:
    token = CancellationToken()
    thread = threading.Thread(target=token.cancel)
    thread.start()
    thread.join()
    assert token.cancelled


def test_a_signal_handler_may_cancel() -> None:
    token = CancellationToken()
    before = signal.signal(signal.SIGTERM, lambda number, frame: token.cancel())
    try:
        os.kill(os.getpid(), signal.SIGTERM)
        assert token.cancelled
    finally:
        signal.signal(signal.SIGTERM, before)
