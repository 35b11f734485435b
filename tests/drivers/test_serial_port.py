"""A serial port that hangs up and comes back, on real pseudo-terminals."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from drivers.serial_port import SerialPort

TIMEOUT_S = 0.15


def test_a_link_to_a_pseudo_terminal_that_hung_up_is_followed_when_it_is_made_anew(tmp_path: Path) -> None:
    link = tmp_path / "device"
    master, slave = os.openpty()
    link.symlink_to(os.ttyname(slave))
    port = SerialPort(str(link), 115200, TIMEOUT_S)
    os.close(slave)
    os.close(master)  # as a server does that is killed: its link stays
    with pytest.raises(OSError, match=r"hung up|Input/output"):
        port.receive(0.0)
    port.close()
    master, slave = os.openpty()  # another program's terminal: as a rule it has the same number
    with pytest.raises(OSError, match="which hung up: start the device again"):
        SerialPort(str(link), 115200, TIMEOUT_S)
    link.unlink()
    link.symlink_to(os.ttyname(slave))
    SerialPort(str(link), 115200, TIMEOUT_S).close()
    SerialPort(str(link), 115200, TIMEOUT_S).close()  # closed by us: it did not hang up
    os.close(slave)
    os.close(master)
