"""The sketch on an emulated Arduino UNO, with Arduino's own core: a device that our protocol takes for one of ours."""

from __future__ import annotations

import math
import shutil
import subprocess
from pathlib import Path

import pytest
from firmware_cases import Board, board, sources, wait_until

from rtctl.border.records import VO2, DeviceStatus, Measurement
from rtctl.border.wire.serial_frames import (
    Layout,
    Request,
    Settings,
    identity_of,
    settings_of,
    settings_payload,
)

pytestmark = pytest.mark.wire

CORE = Path("/usr/share/arduino/hardware/arduino/avr")
SIMAVR = Path("/usr/include/simavr/sim_avr.h")
CORE_FILES = (
    "cores/arduino/hooks.c", "cores/arduino/wiring.c", "cores/arduino/wiring_analog.c",
    "cores/arduino/wiring_digital.c", "cores/arduino/main.cpp", "cores/arduino/abi.cpp", "cores/arduino/new.cpp",
    "cores/arduino/HardwareSerial.cpp", "cores/arduino/HardwareSerial0.cpp", "cores/arduino/Print.cpp",
    "libraries/Wire/src/Wire.cpp", "libraries/Wire/src/utility/twi.c",
)  # fmt: skip
INCLUDE = [f"-I{CORE / folder}" for folder in ("cores/arduino", "variants/standard", "libraries/Wire/src")]
FLAGS = [
    "-mmcu=atmega328p",
    "-DF_CPU=16000000L",
    "-DARDUINO=10813",
    "-DARDUINO_ARCH_AVR",
    "-DWIRE_HAS_TIMEOUT",
    "-Os",
]
SECTIONS = ["-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections", "-fno-threadsafe-statics"]
RAM_BYTES = 2048


@pytest.fixture(scope="module")
def uno(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """The command of an emulated UNO with the sketch, less its voltage; skips where the tools are missing."""
    missing = [tool for tool in ("gcc", "avr-gcc", "avr-g++") if shutil.which(tool) is None]
    missing += [str(path) for path in (CORE, SIMAVR) if not path.exists()]
    if missing:
        pytest.skip(
            f"{', '.join(missing)} missing (Debian: arduino-core-avr, gcc-avr, libsimavr-dev, libelf-dev)"
        )
    folder = tmp_path_factory.mktemp("uno")
    library, sketch, emulator = folder / "firmware", folder / "sketch.elf", folder / "uno"
    sources(library)
    built = [str(CORE / file) for file in CORE_FILES]
    strict = [
        str(library / "src" / "rtctl_device.c"),
        str(library / "examples" / "rtctl_vo2" / "rtctl_vo2.ino"),
    ]
    objects = []
    for file in built + strict:
        out = folder / f"{len(objects)}.o"
        is_c = file.endswith(".c")
        language = (
            ["-x", "c", "-std=gnu11"] if is_c else ["-x", "c++", "-std=gnu++11", "-include", "Arduino.h"]
        )
        warnings = ["-Wall", "-Wextra", "-Werror"] if file in strict else ["-w"]
        flags = [*FLAGS, *SECTIONS[: 2 if is_c else 4], *warnings, *INCLUDE, f"-I{library / 'src'}"]
        called("avr-gcc" if is_c else "avr-g++", *flags, *language, "-c", file, "-o", str(out))
        objects.append(str(out))
    called("avr-gcc", *FLAGS, *SECTIONS[2:3], *objects, "-lm", "-o", str(sketch))
    source = Path(__file__).with_name("arduino") / "uno.c"
    called("gcc", "-O2", "-Wall", "-Wextra", "-Werror", str(source), "-lsimavr", "-lelf", "-o", str(emulator))
    return [str(emulator), str(sketch)]


def called(*command: str) -> str:
    """What a program says."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


LAYOUT = Layout(VO2)


def measurement(payload: bytes) -> Measurement:
    """The reading of an answer."""
    reading = LAYOUT.measurement(payload)
    assert reading is not None
    return reading


def test_it_keeps_limits_and_lease_and_has_no_lockstep(uno: list[str]) -> None:
    with board([*uno, "2500"]) as device:
        identity = identity_of(device.ask(Request.IDENTIFY, 1).payload)
        assert identity is not None
        assert identity.name == "MY FILM"
        asked = Settings(enable=1, lockstep=1, watchdog_ms=200, period_us=1000)
        in_force = settings_of(device.ask(Request.SETTINGS, 2, settings_payload(asked)).payload)
        assert in_force == asked._replace(lockstep=0)
        reading = measurement(device.ask(Request.COMMAND, 3, LAYOUT.command([3.0])).payload)
        assert (reading.sequence, reading.status) == (3, DeviceStatus.ENABLED)
        assert reading.sensed[0] == pytest.approx(47e3, rel=0.01), (
            "half of the reference: the divider's two halves"
        )
        assert math.isnan(reading.reference)
        clamped = measurement(device.ask(Request.COMMAND, 4, LAYOUT.command([9.5])).payload)
        assert clamped.status == DeviceStatus.ENABLED | DeviceStatus.CLAMPED
        wait_until(
            lambda: status(device, Request.READ) & DeviceStatus.WATCHDOG_TRIPPED, "the lease never ended"
        )
        refused = status(device, Request.COMMAND, LAYOUT.command([3.0]))
        assert refused & DeviceStatus.REFUSED
        # converter of 4096 counts to 10 mA: 0 at the start, 3 mA, 8.5 mA (the limit), 0 mA (safe)
        assert [int(counts) for counts in device.told(4)] == [0, 1229, 3481, 0]


def status(device: Board, kind: Request, payload: bytes = b"") -> int:
    """Status of one more answer."""
    return measurement(device.ask(kind, 9, payload).payload).status


def test_it_leaves_a_quarter_of_the_memory_to_the_stack(uno: list[str]) -> None:
    _, sizes = called("avr-size", uno[1]).splitlines()
    _, initialised, zeroed, *_ = map(int, sizes.split()[:3])
    assert initialised + zeroed <= 0.75 * RAM_BYTES


@pytest.mark.parametrize("fault", [("0",), ("5000",), ("2500", "without-converter")], ids=" ".join)
def test_a_short_circuit_a_broken_wire_and_a_lost_converter_are_sensor_faults(
    fault: tuple[str, ...], uno: list[str]
) -> None:
    with board([*uno, *fault]) as device:
        reading = measurement(device.ask(Request.READ, 1).payload)
        assert math.isnan(reading.sensed[0])
        assert reading.status == DeviceStatus.SENSOR_FAULT
