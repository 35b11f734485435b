"""The firmware is the device that the Python definitions describe: the same constants, answers and film."""

from __future__ import annotations

import re
import struct
import tomllib
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from firmware_cases import board, host_board, host_program

from drivers import firmware
from plant_sim.catalogue import bundled_plant
from plant_sim.device import SimulatedDevice
from plant_sim.wire.serial_server import SerialDevice
from rtctl.border.records import VO2, DeviceStatus, Measurement
from rtctl.border.wire.serial_frames import (
    ERROR,
    MAX_BODY,
    REPLY,
    VERSION,
    ErrorCode,
    FrameReader,
    Layout,
    Message,
    Request,
    Settings,
    frame,
    settings_payload,
)
from rtctl.wiring import load_plant

pytestmark = pytest.mark.wire

ROOT = Path(__file__).resolve().parents[2]
LAYOUT = Layout(VO2)
NOISE_OHM, NOISE_UM = 300.0, 0.5
"""More than the instruments' noise and 1/f noise make of a reading, less than any other current does."""
C_NAMES = {
    "RS_VERSION": VERSION,
    "RS_MAX_BODY": MAX_BODY,
    "RS_REPLY": REPLY,
    "RS_ERROR": ERROR,
    **{f"RS_{one.name}": int(one) for kind in (Request, ErrorCode) for one in kind},
    **{f"RS_{one.name}": int(one) for one in DeviceStatus if one is not DeviceStatus.WATCHDOG_TRIPPED},
    "RS_TRIPPED": int(DeviceStatus.WATCHDOG_TRIPPED),
}


def test_the_header_has_the_numbers_of_the_python_definitions() -> None:
    header = (firmware.SOURCES / "src" / "rtctl_serial.h").read_text(encoding="utf-8")
    found = {name: int(value, 0) for name, value in re.findall(r"\b(RS_\w+) = (0x\w+|\d+)\b", header)}
    assert found == C_NAMES


def test_the_library_has_the_version_of_the_program() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    properties = (firmware.SOURCES / "library.properties").read_text(encoding="utf-8")
    assert f"version={project['project']['version']}\n" in properties


class Course(NamedTuple):
    """How the settings of random messages change the clock."""

    lockstep: tuple[int, ...]
    watchdog_ms: tuple[int, ...]
    settings: Settings
    """The first ones."""


LOCKSTEP = Course((1, 1, 1, 7), (0, 1, 2, 250), Settings(1, 1, 0, 1000))
"""What passes between two requests is no matter: readings and times are compared, too."""
EITHER = Course((0, 1, 7), (0, 60_000), Settings(1, 0, 0, 1000))
"""Free-running as well: a reading depends on when it is asked for."""


def random_request(rng: np.random.Generator, tag: int, course: Course) -> bytes:
    """Any message, most of them sound: commands in and out of range, settings, repeats, damaged and wrong ones."""
    kinds = {"command": 0.6, "read": 0.1, "settings": 0.15, "identify": 0.05, "any": 0.05, "damaged": 0.05}
    kind = rng.choice(list(kinds), p=list(kinds.values()))
    if kind == "command":
        levels = {rng.uniform(-2.0, 12.0): 0.3, rng.uniform(3.0, 8.0): 0.6, np.nan: 0.05, np.inf: 0.05}
        return frame(
            Request.COMMAND, tag, struct.pack("<f", rng.choice(list(levels), p=list(levels.values())))
        )
    if kind == "settings":
        choices = ([0, 1, 1, 1, 2], course.lockstep, course.watchdog_ms, [0, 700, 1000, 5000])
        asked = Settings(*(int(rng.choice(values)) for values in choices))
        return frame(Request.SETTINGS, tag, settings_payload(asked))
    if kind == "any":
        return frame(int(rng.integers(0, 256)), tag, rng.bytes(int(rng.integers(0, 30))))
    if kind == "identify":
        return frame(Request.IDENTIFY, tag)
    sound = frame(Request.READ, tag)
    if kind == "read":
        return sound
    damaged = bytearray(sound)  # followed by a sound one, since silence is its answer
    damaged[2] ^= 1 << int(rng.integers(0, 8))
    return rng.bytes(5) + b"\0" + bytes(damaged) + sound


@pytest.mark.parametrize("course", [LOCKSTEP, EITHER], ids=["lockstep", "either clock"])
def test_it_answers_random_messages_as_the_simulated_device_does(course: Course, host_firmware: Path) -> None:
    rng = np.random.default_rng(34)
    simulated = SerialDevice(SimulatedDevice(load_plant(bundled_plant("vo2_a"))))
    request = frame(Request.SETTINGS, 1, settings_payload(course.settings))
    seen: set[tuple[int, int]] = set()
    with board(host_board(host_firmware)) as device:
        for tag in rng.integers(0, 40, 2000):  # few numbers, so that many are repeats
            (found,) = FrameReader().feed(device.answer(request))
            (wanted,) = FrameReader().feed(simulated.receive(request))
            assert same(found, wanted, course), f"{request.hex(' ')}: {found} instead of {wanted}"
            reading = reading_of(found)
            seen.add((found.type, 0 if reading is None else reading.status))
            request = random_request(rng, int(tag), course)
    assert {kind for kind, _ in seen} == {0x81, 0x82, 0x83, 0x84, 0xFF}
    statuses = {status for kind, status in seen if kind == 0x81}
    assert {1, 1 | 4, 16} <= statuses, "enabled, clamped, refused"
    assert course is EITHER or {1 | 2, 1 | 2 | 16} <= statuses, "tripped, refused because of it"


def reading_of(message: Message) -> Measurement | None:
    """The reading of a message that has one."""
    return LAYOUT.measurement(message.payload) if message.type in (0x81, 0x82) else None


def same(found: Message, wanted: Message, course: Course) -> bool:
    """To the byte, save for what noise makes of a reading, and for readings and times of a device on its own clock."""
    one, other = reading_of(found), reading_of(wanted)
    if found[:2] != wanted[:2] or one is None or other is None:
        return found == wanted
    if course is EITHER:
        return (one.counter, one.sequence, one.status) == (other.counter, other.sequence, other.status)
    near = (
        abs(one.sensed[0] - other.sensed[0]) < NOISE_OHM and abs(one.reference - other.reference) < NOISE_UM
    )
    return near and one[2:] == other[2:]


def test_a_lockstep_run_does_not_depend_on_how_long_the_device_has_waited_for_it(host_firmware: Path) -> None:
    lockstep = frame(Request.SETTINGS, 9, settings_payload(Settings(1, 1, 0, 1000)))
    commands = [frame(Request.COMMAND, tag, LAYOUT.command([8.0])) for tag in range(5)]

    def answers(readings_before: int) -> list[bytes]:
        with board(host_board(host_firmware)) as device:
            for tag in range(readings_before):
                device.ask(Request.READ, tag)
            return [device.answer(request) for request in (lockstep, *commands)]

    assert answers(0) == answers(7)


QUIET = {
    r'white = "[^"]*"': 'white = "0 V"',
    r'flicker = "[^"]*"': 'flicker = "0 1/Hz^0.5"',
    r'reference = "[^"]*"': 'reference = "0 um"',
    r"converter_bits = \d+": "converter_bits = 0",
}


def quiet_device(name: str, mixing: str, folder: Path) -> Path:
    """The file of a bundled device with ideal instruments."""
    text = bundled_plant(name).read_text(encoding="utf-8")
    for pattern, ideal in {**QUIET, r'mixing = "\w+"': f'mixing = "{mixing}"'}.items():
        text, count = re.subn(pattern, ideal, text)
        assert count == 1, pattern
    path = folder / f"{name}_{mixing}.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("name", "mixing"), [("vo2_a", "logarithmic"), ("vo2_b", "bruggeman"), ("vo2_a", "series")]
)
def test_its_film_is_that_of_the_simulated_device(name: str, mixing: str, tmp_path: Path) -> None:
    path = quiet_device(name, mixing, tmp_path)
    simulated = SimulatedDevice(load_plant(path))
    simulated.set_clock(lockstep=True, period_us=1000)
    simulated.set_enable(True)
    rng = np.random.default_rng(2016)
    levels = np.repeat(rng.uniform(3.0, 8.4, 120), rng.integers(1, 12, 120))  # whole and minor loops
    readings = []
    with board(host_board(host_program(tmp_path / "firmware", path))) as device:
        device.ask(Request.SETTINGS, 1, settings_payload(Settings(1, 1, 0, 1000)))
        for tag, level in enumerate(levels):
            answer = device.ask(Request.COMMAND, tag, LAYOUT.command([level]))
            own, other = LAYOUT.measurement(answer.payload), simulated.exchange((float(level),), tag)
            assert own is not None
            readings.append((own.sensed[0], other.sensed[0], own.reference, other.reference))
    own_ohm, ohm, own_um, um = np.array(readings).T
    assert ohm.max() > 5.0 * ohm.min()
    # float32 against float64: rounded temperatures switch single domains a sample earlier or later, 1/8192 of a loop
    assert np.abs(own_ohm / ohm - 1.0).max() < 1e-3
    assert np.abs(own_um - um).max() < 0.02
