"""What a bad line does to the serial driver: nothing where it can be helped, else a fault with a name; and back."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from firmware_cases import on_terminal
from peers import PtyEnd, Script, scripted
from serial_cases import sessions

from drivers.serial_frames import SerialDriver
from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.border.records import ME, VO2, DeviceStatus
from rtctl.border.wire.serial_frames import frame
from rtctl.cli import main

pytestmark = [pytest.mark.wire, pytest.mark.usefixtures("either_form")]

HANDSHAKE: Script = [(exchange.request, exchange.reply) for exchange in sessions()[0][:4]]
TIMEOUT_S = 0.15
NOISE = bytes.fromhex("13 00 77 ff 21 00 09 09")


def reading(sequence: int, counter: int = 2, status: int = 1) -> bytes:
    return struct.pack("<HHIIff", sequence, status, counter, 1000, 1.0, 5e4)


def command(tag: int, level: float = 5.0) -> bytes:
    return frame(1, tag, struct.pack("<f", level))


def answer(tag: int, counter: int = 2) -> bytes:
    return frame(0x81, tag, reading(tag, counter))


def flipped(data: bytes) -> bytes:
    return data[:6] + bytes((data[6] ^ 0x20,)) + data[7:]


def opened(end: PtyEnd, pipeline: int = 0) -> SerialDriver:
    driver = SerialDriver(port=end.path, baud=115200, profile=VO2, first_tag=0x1000, pipeline=pipeline)
    driver.open(lockstep_period_us=None if pipeline else 1000, watchdog_ms=250, timeout_s=TIMEOUT_S)
    return driver


SURVIVED: dict[str, Callable[[bytes], bytes]] = {
    "noise before": lambda reply: NOISE + reply,
    "a late answer before": lambda reply: answer(0x1003, 77) + reply,
    "a late reading of the same number before": lambda reply: frame(0x82, 0x1004, reading(9)) + reply,
    "a damaged answer before": lambda reply: flipped(reply) + reply,
    "the answer twice": lambda reply: reply + reply,
}


@pytest.mark.parametrize("case", SURVIVED)
def test_what_does_not_belong_here_is_thrown_away(case: str) -> None:
    end = PtyEnd()
    script = [
        *HANDSHAKE,
        (command(0x1004), SURVIVED[case](answer(0x1004))),
        (command(0x1005), answer(0x1005, 3)),
    ]
    with scripted(end, script):
        driver = opened(end)
        assert driver.exchange((5.0,)).counter == 2
        assert driver.exchange((5.0,)).counter == 3


NAMED: dict[str, tuple[bytes, Fault, str]] = {
    "silence": (b"", Fault.NO_ANSWER, r"no answer to command 4100 within 150 ms \(0 damaged frames\)"),
    "damage": (flipped(answer(0x1004)), Fault.NO_ANSWER, r"\(1 damaged frames\)"),
    "half an answer": (answer(0x1004)[:9], Fault.NO_ANSWER, "no answer to command 4100"),
    "error 3": (frame(0xFF, 0x1004, b"\3"), Fault.COMMAND_REFUSED, r"error 3 \(illegal value\)"),
    "another number in force": (
        frame(0x81, 0x1004, reading(9)),
        Fault.STALE_REPLY,
        "command number 9 is in force, sent was 4100",
    ),
    "a reading of another kind": (
        frame(0x81, 0x1004, reading(0x1004) + b"\0\0\0\0"),
        Fault.COMMAND_REFUSED,
        "another length: is this device of kind vo2",
    ),
}


@pytest.mark.parametrize("case", NAMED)
def test_what_cannot_be_helped_is_named_and_the_next_exchange_is_sound(case: str) -> None:
    reply, fault, words = NAMED[case]
    end = PtyEnd()
    script = [*HANDSHAKE, (command(0x1004), reply), (command(0x1005), answer(0x1004) + answer(0x1005, 3))]
    with scripted(end, script):
        driver = opened(end)
        with pytest.raises(DriverError, match=words) as caught:
            driver.exchange((5.0,))
        assert caught.value.fault is fault
        assert driver.exchange((5.0,)).counter == 3


def test_refusal_by_status_is_the_loops_to_judge() -> None:
    end = PtyEnd()
    refused = int(DeviceStatus.ENABLED | DeviceStatus.REFUSED)
    with scripted(end, [*HANDSHAKE, (command(0x1004), frame(0x81, 0x1004, reading(0, status=refused)))]):
        assert opened(end).exchange((5.0,)).status == refused


def test_a_line_that_goes_away_is_named_and_another_one_is_opened_by_the_same_driver() -> None:
    end = PtyEnd()
    with scripted(end, HANDSHAKE) as peer:
        driver = opened(end)
        peer.wait()
        end.vanish()
        with pytest.raises(DriverError) as caught:
            driver.exchange((5.0,))
        assert caught.value.fault is Fault.CONNECTION_LOST
        driver.close((0.0,))
    again = PtyEnd()
    driver._path = again.path  # a link leads there as a rule
    requests = [frame(4, 0x1005), frame(3, 0x1006, b"\0\1\xfa\0\xe8\3\0\0")]
    identity = HANDSHAKE[0][1][1:-1]
    assert identity
    with scripted(
        again, [(requests[0], frame(0x84, 0x1005, b"\1\1\1" + 16 * b"A")), (requests[1], b"")]
    ) as peer:
        with pytest.raises(DriverError) as caught:
            driver.open(lockstep_period_us=1000, watchdog_ms=250, timeout_s=TIMEOUT_S)
        assert caught.value.fault is Fault.NO_ANSWER
        peer.wait()
        assert peer.asked == requests, "numbers go on: no answer to an earlier request fits a later one"


def test_pipelined_an_answer_belongs_to_the_command_so_many_exchanges_ago() -> None:
    end = PtyEnd()
    off, on = (
        (frame(3, tag, payload), frame(0x83, tag, payload))
        for tag, payload in ((0x1001, b"\0\0\xfa\0\0\0\0\0"), (0x1002, b"\1\0\xfa\0\0\0\0\0"))
    )
    script = [
        *(HANDSHAKE[0], off, on, HANDSHAKE[3]),
        (frame(2, 0x1004) + frame(2, 0x1005), frame(0x82, 0x1004, reading(0, 2)) + frame(0x82, 0x1005, reading(0, 3))),
        (command(0x1006) + command(0x1007) + command(0x1008), answer(0x1006, 4)),
        (command(0x1009), answer(0x1008, 6)),
    ]  # fmt: skip
    with scripted(end, script):
        driver = opened(end, pipeline=2)
        assert [driver.exchange((5.0,)).counter for _ in range(3)] == [2, 3, 4]
        with pytest.raises(
            DriverError, match="command 4103 though a later request has been answered"
        ) as caught:
            driver.exchange((5.0,))
        assert caught.value.fault is Fault.NO_ANSWER


def test_pipelining_in_lockstep_is_bad_input() -> None:
    driver = SerialDriver(port="/dev/null", baud=115200, profile=VO2, pipeline=1)
    with pytest.raises(InputError, match="free-running"):
        driver.open(lockstep_period_us=1000, watchdog_ms=0, timeout_s=TIMEOUT_S)


def test_device_of_another_kind_is_named() -> None:
    end = PtyEnd()
    driver = SerialDriver(port=end.path, baud=115200, profile=ME, first_tag=0x1000)
    with scripted(end, HANDSHAKE), pytest.raises(DriverError, match=r"should be \(1, 2, 2\).*kind me"):
        driver.open(lockstep_period_us=1000, watchdog_ms=0, timeout_s=TIMEOUT_S)


def test_a_device_without_lockstep_says_what_to_set() -> None:
    end = PtyEnd()
    settings = HANDSHAKE[1][0]
    assert settings == frame(3, 0x1001, b"\0\1\xfa\0\xe8\3\0\0")
    live = frame(0x83, 0x1001, b"\0\0\xfa\0\xe8\3\0\0")
    with (
        scripted(end, [HANDSHAKE[0], (settings, live)]),
        pytest.raises(DriverError, match=r'has no lockstep: set clock\.mode = "live"'),
    ):
        opened(end)


SCENARIO = """
[scenario]
title = "two levels"
period = "2 ms"
[[excitation]]
kind = "levels"
hold = "50 ms"
levels = ["20 %", "80 %"]
"""


@pytest.mark.parametrize("pipeline", [None, 0, 2], ids=["lockstep", "live", "pipelined"])
def test_the_loop_drives_the_firmware_over_a_pty(
    pipeline: int | None, host_firmware: Path, tmp_path: Path
) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text(SCENARIO, encoding="utf-8")
    live = ["clock.mode=live", f"driver.pipeline={pipeline}", "clock.timeout=2 s", "clock.watchdog=4 s"]
    settings = [word for setting in ([] if pipeline is None else live) for word in ("--set", setting)]
    with on_terminal(host_firmware, tmp_path / "heater") as wire:
        assert main(["acquire", str(file), "--out", str(tmp_path / "data"), "--quiet", *wire, *settings]) == 0
    (record,) = (tmp_path / "data").glob("r0*.parquet")
    resistance = pq.read_table(record)["resistance"].to_numpy()
    assert resistance.max() > 5.0 * resistance.min(), "the second level is hotter"
