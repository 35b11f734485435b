"""A served device as a process: its ready line, its port, its end, and what is read when it cannot start."""

from __future__ import annotations

import asyncio
import os
import select
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from recording_plant import RecordingPlant

from plant_sim.device import SimulatedDevice
from plant_sim.wire.serve import Wires, parse_address, served
from plant_sim.wire.virtual_port import virtual_port
from rtctl.border.errors import InputError

pytestmark = pytest.mark.wire

SERVE = """
import signal
import sys
from pathlib import Path
from plant_sim.wire.serve import Wires, serve
from recording_plant import RecordingPlant
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup, if the tests run under it, is inherited
serve(RecordingPlant(), Wires(rtu_path=Path(sys.argv[1]), tcp="127.0.0.1:0"))
"""


@contextmanager
def serving(path: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    with subprocess.Popen(
        [sys.executable, "-W", "error", "-c", SERVE, str(path)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        try:
            yield process, process.stdout.readline()
        finally:
            process.kill()


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_serves_until_a_signal_and_leaves_nothing_behind(tmp_path: Path, end: signal.Signals) -> None:
    path = tmp_path / "port"
    with serving(path) as (process, ready):
        assert ready.startswith(f"ready modbus-rtu {path} modbus-tcp 127.0.0.1:")
        assert ready.endswith(" unit 1 identity RECORDER\n")
        assert path.is_symlink()
        process.send_signal(end)
        _, errors = process.communicate(timeout=20)
        assert (process.returncode, errors) == (0, "")
    assert not os.path.lexists(path)


def test_killed_server_leaves_a_link_that_the_next_one_replaces(tmp_path: Path) -> None:
    path = tmp_path / "port"
    path.symlink_to("/dev/pts/does-not-exist")
    with virtual_port(path) as master:
        assert path.is_char_device()
        assert os.isatty(master)
    assert not os.path.lexists(path)


def test_every_byte_passes_the_port_as_it_is_and_none_is_echoed(tmp_path: Path) -> None:
    everything = bytes(range(256))
    with virtual_port(tmp_path / "port") as master:
        slave = os.open(tmp_path / "port", os.O_RDWR | os.O_NOCTTY)
        try:
            for near, far in ((slave, master), (master, slave)):
                os.write(near, everything)
                arrived = b""
                while len(arrived) < 256:
                    assert select.select([far], [], [], 5.0)[0], f"only {arrived.hex()} arrived"
                    arrived += os.read(far, 4096)
                assert arrived == everything
        finally:
            os.close(slave)


def test_port_in_use_is_not_taken_over(tmp_path: Path) -> None:
    path = tmp_path / "port"
    with virtual_port(path):
        with pytest.raises(InputError, match=r"port: is a link to /dev/.*in use"), virtual_port(path):
            pass
        assert path.exists(), "the first server's link stays"


def test_file_of_the_user_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "thesis.txt"
    path.write_text("years")
    with pytest.raises(InputError, match=r"thesis\.txt: exists and is not a serial port"), virtual_port(path):
        pass
    assert path.read_text() == "years"


def test_missing_folder_is_named(tmp_path: Path) -> None:
    with (
        pytest.raises(InputError, match="nowhere/port: cannot make"),
        virtual_port(tmp_path / "nowhere/port"),
    ):
        pass


def test_link_that_somebody_else_has_taken_over_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "port"
    with virtual_port(path):
        path.unlink()
        path.symlink_to(tmp_path)
    assert path.is_symlink()


async def _start(tcp: str | None) -> str:
    async with served(SimulatedDevice(RecordingPlant()), Wires(tcp=tcp)) as ends:
        if tcp is not None and tcp.endswith(":0"):
            await _start(ends.split()[1])
        return ends


def test_tcp_port_in_use_is_named() -> None:
    with pytest.raises(InputError, match=r"^127\.0\.0\.1:\d+: cannot serve there: the port is taken"):
        asyncio.run(_start("127.0.0.1:0"))


def test_nowhere_to_serve_is_named() -> None:
    with pytest.raises(InputError, match="nothing to serve on"):
        asyncio.run(_start(None))


def test_address_with_a_bracketed_host() -> None:
    assert parse_address("[::1]:5020") == ("::1", 5020)


def test_a_port_that_is_too_large_is_told_its_limit() -> None:
    with pytest.raises(InputError, match="port 70000 is above 65535"):
        parse_address("localhost:70000")


@pytest.mark.parametrize("address", ["5020", "localhost", ":5020", "localhost:", "localhost:x"])
def test_address_must_be_host_and_port(address: str) -> None:
    with pytest.raises(InputError, match="HOST:PORT"):
        parse_address(address)
