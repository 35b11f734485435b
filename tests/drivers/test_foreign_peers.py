"""Others speak Modbus too: mbpoll and libmodbus to our device, our drivers to libmodbus and pymodbus's simulator."""

from __future__ import annotations

import asyncio
import os
import select
import shutil
import socket
import subprocess
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import SimpleQueue

import pytest
from peers import serving
from pymodbus.constants import ExcCodes
from pymodbus.framer import FramerType
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from drivers.modbus import ModbusDriver, ModbusRtuDriver, ModbusTcpDriver
from plant_sim.catalogue import bundled_plant
from plant_sim.device import SimulatedDevice
from plant_sim.wire.serve import Wires
from rtctl.border.records import VO2, DeviceStatus
from rtctl.wiring import load_plant

pytestmark = pytest.mark.wire

ROOT = Path(__file__).resolve().parents[2]
HEADERS = Path("/usr/include/modbus")


@contextmanager
def served_device(wire: str, folder: Path) -> Iterator[tuple[SimulatedDevice, str]]:
    """One of ours, and its port or HOST:PORT."""
    device = SimulatedDevice(load_plant(bundled_plant("vo2_a"), seed=5))
    wires = Wires(rtu_path=folder / "port") if wire == "rtu" else Wires(tcp="127.0.0.1:0")
    with serving(device, wires) as ends:
        yield device, ends.split()[1]


@pytest.mark.parametrize("wire", ["rtu", "tcp"])
def test_mbpoll_writes_and_reads_our_device(wire: str, tmp_path: Path) -> None:
    mbpoll = shutil.which("mbpoll")
    if mbpoll is None:
        pytest.skip("there is no mbpoll here")
    with served_device(wire, tmp_path) as (device, where):
        host, _, port = where.rpartition(":")
        line = ["-m", "rtu", "-b", "115200", "-P", "none"] if wire == "rtu" else ["-m", "tcp", "-p", port]

        def poll(*words: str) -> str:
            end = where if wire == "rtu" else host
            command = [mbpoll, *line, "-a", "1", "-0", "-1", "-o", "5", "-q", *words[:-1], end, words[-1]]
            command = [word for word in command if word]
            done = subprocess.run(command, capture_output=True, text=True, timeout=30.0, check=False)
            assert done.returncode == 0, done.stdout + done.stderr
            return done.stdout

        poll("-r", "3", "-t", "4", "1")
        assert device.enabled
        poll("-r", "0", "-t", "4:float", "-B", "5.25")
        assert "5.25" in poll("-r", "0", "-t", "4:float", "-B", "-c", "1", "")
        text = poll("-r", "100", "-t", "4:float", "-B", "-c", "1", "")
        resistance = float(text.rsplit("[100]:", 1)[1].split()[0])
        assert 1e3 < resistance < 1e6
        assert "[120]:" in poll("-r", "120", "-t", "4:hex", "-c", "8", "")


def compiled(source: Path, folder: Path) -> Path:
    """A program with libmodbus; skips the test where that is not installed."""
    gcc = shutil.which("gcc")
    if gcc is None or not HEADERS.is_dir():
        pytest.skip("gcc or libmodbus's headers are not here")
    program = folder / source.stem
    command = [gcc, "-O2", "-Wall", "-DWITH_LIBMODBUS", f"-I{HEADERS}", "-o", str(program), str(source)]
    subprocess.run([*command, "-lmodbus"], check=True)
    return program


@pytest.mark.parametrize("wire", ["rtu", "tcp"])
def test_a_libmodbus_client_exchanges_with_our_device(wire: str, tmp_path: Path) -> None:
    program = compiled(ROOT / "benchmarks" / "wire_peer.c", tmp_path)
    with served_device(wire, tmp_path) as (device, where):
        end = [where] if wire == "rtu" else where.split(":")
        done = subprocess.run([program, wire, *end, "25"], capture_output=True, text=True, timeout=60.0)
        assert done.returncode == 0, done.stderr
        assert len(done.stdout.split()) == 25
        reading = device.read()
        assert reading.counter == 1 + 25
        assert reading.time_us == 25_000


@contextmanager
def null_modem() -> Iterator[tuple[str, str]]:
    """Two serial ports, each of which carries what is written to the other."""
    near, far = os.openpty(), os.openpty()
    stopped, stop = os.pipe()
    for _, slave in (near, far):
        tty.setraw(slave)

    def carry() -> None:
        other = {near[0]: far[0], far[0]: near[0]}
        while True:
            ready = select.select([*other, stopped], [], [])[0]
            if stopped in ready:
                return
            for master in ready:
                os.write(other[master], os.read(master, 4096))

    thread = threading.Thread(target=carry)
    thread.start()
    try:
        yield os.ttyname(near[1]), os.ttyname(far[1])
    finally:
        os.write(stop, b"x")
        thread.join()
        for end in (*near, *far, stopped, stop):
            os.close(end)


def assert_drives(driver: ModbusDriver, resistance: float) -> None:
    """A session with a device that is not ours."""
    first = driver.open(lockstep_period_us=1000, watchdog_ms=250, timeout_s=5.0)
    readings = [driver.exchange((level,)) for level in (4.0, 5.0, 6.0)]
    driver.close((0.0,))
    for previous, reading in zip([first, *readings], readings, strict=False):
        assert reading.sequence == (previous.sequence + 1) & 0xFFFF
        assert reading.counter > previous.counter
        assert reading.sensed == (resistance,)
        assert reading.status == DeviceStatus.ENABLED


@contextmanager
def libmodbus_server(program: Path, *arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    """The program, ended with the block."""
    with subprocess.Popen([program, *arguments], stdout=subprocess.PIPE) as server:
        try:
            yield server
        finally:
            server.kill()


def test_our_driver_drives_a_libmodbus_server_over_rtu(tmp_path: Path) -> None:
    program = compiled(Path(__file__).with_name("modbus_server.c"), tmp_path)
    with null_modem() as (here, there), libmodbus_server(program, "rtu", there) as server:
        assert server.stdout is not None
        assert server.stdout.readline() == b"ready\n"
        assert_drives(ModbusRtuDriver(port=here, baud=115200, unit=1, profile=VO2), 12345.5)


def test_our_driver_drives_a_libmodbus_server_over_tcp(tmp_path: Path) -> None:
    program = compiled(Path(__file__).with_name("modbus_server.c"), tmp_path)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with libmodbus_server(program, "tcp", str(port)):
        wait_for(port)
        assert_drives(ModbusTcpDriver(host="127.0.0.1", port=port, unit=1, profile=VO2), 12345.5)


def wait_for(port: int) -> None:
    """Until a server listens there, without a connection of its own: it takes only one."""
    wanted = f"0100007F:{port:04X} 00000000:0000 0A"
    while wanted not in Path("/proc/net/tcp").read_text(encoding="ascii"):
        os.sched_yield()


async def follow(
    function: int, start: int, address: int, count: int, registers: list[int], written: list[int] | None
) -> ExcCodes | None:
    """Called for both halves of function 23: a reading is made for the half that reads."""
    if written is None and address - start <= 100 < address - start + count:
        registers[100:102] = [0x4640, 0xE600]  # 12345.5
        registers[103] += 1
        registers[104] = 1
        registers[109] = registers[2]
    return None


@contextmanager
def simulator(wire: str, where: str) -> Iterator[int]:
    """pymodbus's own, in a thread; its port."""
    ready: SimpleQueue[tuple[int, asyncio.AbstractEventLoop, asyncio.Event]] = SimpleQueue()

    async def serve() -> None:
        stop = asyncio.Event()
        device = SimDevice(
            id=1, simdata=[SimData(0, count=128, values=0, datatype=DataType.REGISTERS)], action=follow
        )
        if wire == "rtu":
            server = ModbusSerialServer(device, framer=FramerType.RTU, port=where, baudrate=115200)
        else:
            server = ModbusTcpServer(device, address=("127.0.0.1", 0))
        await server.serve_forever(background=True)
        port = 0 if wire == "rtu" else server.transport.sockets[0].getsockname()[1]
        ready.put((port, asyncio.get_running_loop(), stop))
        await stop.wait()
        await server.shutdown()

    thread = threading.Thread(target=asyncio.run, args=(serve(),))
    thread.start()
    port, loop, stop = ready.get(timeout=20.0)
    try:
        yield port
    finally:
        loop.call_soon_threadsafe(stop.set)
        thread.join(20.0)


def test_our_driver_drives_pymodbus_simulator_over_tcp() -> None:
    with simulator("tcp", "") as port:
        assert_drives(ModbusTcpDriver(host="127.0.0.1", port=port, unit=1, profile=VO2), 12345.5)


def test_our_driver_drives_pymodbus_simulator_over_rtu() -> None:
    with null_modem() as (here, there), simulator("rtu", there):
        assert_drives(ModbusRtuDriver(port=here, baud=115200, unit=1, profile=VO2), 12345.5)
