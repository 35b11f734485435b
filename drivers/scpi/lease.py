"""The watchdog that a source meter does not have: a small process that switches the output off when its host is gone.

It holds the line's descriptor as well. Each command of the host is a byte to its standard input; when none comes for
the lease, or the input ends without a farewell because the host was killed, it sends the lines that switch off. It runs
as a plain script without the packages of the program, so that it is there at once and outlives whatever they do.
"""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
from contextlib import suppress

RENEW, FAREWELL = b".", b"q"


class Lease:
    """The host's end of the process."""

    def __init__(self, descriptor: int, lines: bytes, lease_s: float) -> None:
        """Start the process; its lease runs from the first renewal.

        Args:
            descriptor: file descriptor of the open line.
            lines: what switches the output off.
            lease_s: how long a renewal holds [s]; 0: until the host ends.
        """
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-S", __file__, str(descriptor), lines.hex(), repr(lease_s)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            pass_fds=[descriptor],
            start_new_session=True,  # a Ctrl-C of the terminal is the host's
        )
        assert self._process.stdin is not None
        self._pipe = self._process.stdin.fileno()

    def renew(self) -> bool:
        """Hold the lease anew; return False if it has ended and the output was switched off."""
        try:
            os.write(self._pipe, RENEW)
        except OSError:
            return False
        return True

    def end(self) -> None:
        """End the process: the output is off. Never raises."""
        with suppress(OSError):
            os.write(self._pipe, FAREWELL)
        with suppress(OSError):
            assert self._process.stdin is not None
            self._process.stdin.close()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(1.0)


def watch(descriptor: int, lines: bytes, lease_s: float) -> None:
    """Wait for renewals on standard input; send `lines` when they end, after what the host began is ended."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    timeout_s: float | None = None
    while select.select([0], [], [], timeout_s)[0]:
        heard = os.read(0, 4096)
        if FAREWELL in heard:
            return
        if not heard:
            break
        timeout_s = lease_s or None
    os.close(0)  # from here on the host hears of it
    with suppress(OSError):
        os.write(descriptor, b"\n" + lines)


if __name__ == "__main__":
    watch(int(sys.argv[1]), bytes.fromhex(sys.argv[2]), float(sys.argv[3]))
