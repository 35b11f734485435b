"""When wire or device fail: the fault has a name, the message an advice, and no late reply is believed."""

from __future__ import annotations

import errno
import os
import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import serial
import transcripts as t
from peers import PtyEnd, ScriptedPeer, TcpEnd, scripted
from transcripts import frame, rtu

from drivers.modbus import ModbusDriver, ModbusRtuDriver, ModbusTcpDriver
from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.border.records import VO2, DeviceStatus

pytestmark = [pytest.mark.wire, pytest.mark.usefixtures("either_form")]

TIMEOUT_S = 0.15


@contextmanager
def rtu_session(*exchanges: tuple[str, str]) -> Iterator[tuple[ModbusRtuDriver, PtyEnd, ScriptedPeer]]:
    """An open driver whose device answers as told."""
    end = PtyEnd()
    driver = ModbusRtuDriver(port=end.path, baud=115200, unit=1, profile=VO2)
    with scripted(end, t.HANDSHAKE + rtu(*exchanges)) as peer:
        driver.open(lockstep_period_us=1_000_000, watchdog_ms=250, timeout_s=TIMEOUT_S)
        yield driver, end, peer
        end.vanish()
        driver.close((0.0,))


def fault_of(driver: ModbusDriver, level: float = 5.0) -> DriverError:
    with pytest.raises(DriverError) as caught:
        driver.exchange((level,))
    return caught.value


def test_silent_device_is_named_with_function_and_limit() -> None:
    with rtu_session((t.COMMAND_42, "")) as (driver, end, _):
        error = fault_of(driver)
        assert error.fault is Fault.NO_ANSWER
        assert f"modbus-rtu {end.path} unit 1: no valid answer to function 23 within 150 ms" in str(error)


def test_damaged_reply_is_no_answer() -> None:
    with rtu_session((t.COMMAND_42, t.REPLY_42[:-1] + "E")) as (driver, _, _):
        assert fault_of(driver).fault is Fault.NO_ANSWER


def test_late_reply_that_waits_on_the_line_is_drained() -> None:
    with rtu_session((t.COMMAND_42, ""), (t.COMMAND_43, t.REPLY_43)) as (driver, end, _):
        assert fault_of(driver).fault is Fault.NO_ANSWER
        end.send_and_wait(frame(t.REPLY_42))
        assert driver.exchange((6.0,)).sequence == 43


@pytest.mark.parametrize("reply", [t.REPLY_42, t.REPLY_42 + t.REPLY_43], ids=["alone", "then the true one"])
def test_late_reply_that_answers_the_next_request_is_not_believed(reply: str) -> None:
    with rtu_session((t.COMMAND_42, ""), (t.COMMAND_43, reply)) as (driver, _, _):
        assert fault_of(driver).fault is Fault.NO_ANSWER
        error = fault_of(driver, 6.0)
        assert error.fault is Fault.STALE_REPLY
        assert "command number 42 is in force, sent was 43" in str(error)


@pytest.mark.parametrize("reply", [t.WRITE_42[1], t.FIRST_READING[1]], ids=["function 16's", "function 3's"])
def test_reply_of_another_function_is_stale(reply: str) -> None:
    with rtu_session((t.COMMAND_42, reply)) as (driver, _, _):
        assert fault_of(driver).fault is Fault.STALE_REPLY


def test_refusal_by_status_is_the_loops_to_judge() -> None:
    with rtu_session((t.COMMAND_42, t.REPLY_42), (t.COMMAND_43, t.REFUSED_43)) as (driver, _, _):
        driver.exchange((5.0,))
        assert driver.exchange((6.0,)).status == DeviceStatus.ENABLED | DeviceStatus.REFUSED


def test_refusal_by_exception_is_named() -> None:
    with rtu_session((t.COMMAND_42, t.ILLEGAL_VALUE)) as (driver, _, _):
        error = fault_of(driver)
        assert error.fault is Fault.COMMAND_REFUSED
        assert "command 5 mA: function 23 was answered with exception 3 (illegal value)" in str(error)


def test_level_beyond_float32_is_refused_before_it_is_sent() -> None:
    with rtu_session() as (driver, _, _):
        assert fault_of(driver, 1e39).fault is Fault.COMMAND_REFUSED


def test_device_that_vanishes_is_a_lost_connection_and_closing_is_quiet() -> None:
    with rtu_session((t.COMMAND_42, t.REPLY_42)) as (driver, end, peer):
        driver.exchange((5.0,))
        peer.wait()
        end.vanish()
        error = fault_of(driver)
        assert error.fault is Fault.CONNECTION_LOST
        assert end.path in str(error)
        driver.close((0.0,))
        driver.close((0.0,))


def test_closed_driver_says_so() -> None:
    driver = ModbusRtuDriver(port="/dev/null", baud=115200, unit=1, profile=VO2)
    assert "is not open" in str(fault_of(driver))


def open_error(driver: ModbusDriver, lockstep_period_us: int | None = None) -> DriverError:
    with pytest.raises(DriverError) as caught:
        driver.open(lockstep_period_us=lockstep_period_us, watchdog_ms=250, timeout_s=TIMEOUT_S)
    return caught.value


def rtu_driver(port: object) -> ModbusRtuDriver:
    return ModbusRtuDriver(port=str(port), baud=115200, unit=1, profile=VO2)


def test_missing_port_is_named(tmp_path: Path) -> None:
    error = open_error(rtu_driver(tmp_path / "port"))
    assert error.fault is Fault.CONNECTION_LOST
    assert re.search(r"modbus-rtu .*/port unit 1: no such port; plug the adapter in, or start", str(error))


def test_file_that_is_no_port_is_named(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("")
    error = open_error(rtu_driver(path))
    assert error.fault is Fault.CONNECTION_LOST
    assert "notes.txt" in str(error)


def test_port_in_use_is_named() -> None:
    end = PtyEnd()
    holder = serial.Serial(end.path, exclusive=True)
    try:
        assert "in use by another program" in str(open_error(rtu_driver(end.path)))
    finally:
        holder.close()
        end.vanish()


def test_forbidden_port_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def forbid(*arguments: object, **options: object) -> None:
        raise serial.SerialException(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(serial, "Serial", forbid)
    assert "permission denied; join the group" in str(open_error(rtu_driver("/dev/ttyUSB0")))


def test_silent_device_at_opening_leaves_the_port_free() -> None:
    end = PtyEnd()
    try:
        assert open_error(rtu_driver(end.path)).fault is Fault.NO_ANSWER
        serial.Serial(end.path, exclusive=True).close()
    finally:
        end.vanish()


def test_device_that_refuses_its_settings_is_named() -> None:
    end = PtyEnd()
    with scripted(end, rtu((t.ENABLE_OFF[0], "01 90 02 CDC1"))):
        error = open_error(rtu_driver(end.path))
    assert error.fault is Fault.COMMAND_REFUSED
    assert "exception 2 (illegal address): is this device of kind vo2?" in str(error)


def test_late_reply_of_an_earlier_session_is_not_taken_for_the_first_reading() -> None:
    end = PtyEnd()
    with scripted(end, t.HANDSHAKE[:-1] + rtu((t.FIRST_READING[0], t.REPLY_42))):
        assert "function 23 instead of 3" in str(
            open_error(rtu_driver(end.path), lockstep_period_us=1_000_000)
        )


def test_watchdog_beyond_its_register_is_bad_input() -> None:
    with pytest.raises(InputError, match="watchdog must be 0"):
        rtu_driver("/dev/null").open(lockstep_period_us=None, watchdog_ms=65536, timeout_s=TIMEOUT_S)


def tcp_driver(port: int) -> ModbusTcpDriver:
    return ModbusTcpDriver(host="127.0.0.1", port=port, unit=1, profile=VO2)


def test_refused_connection_is_named() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    error = open_error(tcp_driver(port))
    assert error.fault is Fault.CONNECTION_LOST
    assert f"modbus-tcp 127.0.0.1:{port} unit 1: connection refused" in str(error)


@pytest.mark.parametrize(
    ("cause", "fault", "words"),
    [
        (socket.gaierror(-2, "unknown"), Fault.CONNECTION_LOST, "unknown host"),
        (TimeoutError(), Fault.NO_ANSWER, "no connection within 150 ms"),
    ],
    ids=["unknown host", "host without an answer"],
)
def test_unreachable_host_is_named(
    monkeypatch: pytest.MonkeyPatch, cause: OSError, fault: Fault, words: str
) -> None:
    def fail(*arguments: object, **options: object) -> None:
        raise cause

    monkeypatch.setattr(socket, "create_connection", fail)
    error = open_error(tcp_driver(5020))
    assert error.fault is fault
    assert words in str(error)


@contextmanager
def tcp_session(*exchanges: tuple[str, str]) -> Iterator[tuple[ModbusTcpDriver, TcpEnd, ScriptedPeer]]:
    end = TcpEnd()
    driver = tcp_driver(end.port)
    with scripted(end, t.TCP_HANDSHAKE + rtu(*exchanges)) as peer:
        driver.open(lockstep_period_us=1_000_000, watchdog_ms=250, timeout_s=TIMEOUT_S)
        yield driver, end, peer
    driver.close((0.0,))


def test_tcp_reply_with_an_old_transaction_number_is_skipped() -> None:
    late_then_true = t.TCP_HANDSHAKE[-1][1].hex() + t.TCP_REPLY_42
    with tcp_session((t.TCP_COMMAND_42, late_then_true)) as (driver, _, _):
        assert driver.exchange((5.0,)).sequence == 42


def test_tcp_after_a_timeout_the_old_connection_and_its_late_reply_are_given_up() -> None:
    half_a_reply = t.TCP_REPLY_42[:20]
    with tcp_session((t.TCP_COMMAND_42, half_a_reply), (t.TCP_COMMAND_43, t.TCP_REPLY_43)) as (
        driver,
        end,
        _,
    ):
        assert fault_of(driver).fault is Fault.NO_ANSWER
        assert driver.exchange((6.0,)).sequence == 43
        assert end.clients == 2


def test_tcp_device_that_vanishes_is_a_lost_connection() -> None:
    with tcp_session() as (driver, end, peer):
        peer.wait()
        end.vanish()
        error = fault_of(driver)
        assert error.fault is Fault.CONNECTION_LOST
        assert "hung up" in str(error) or "reset" in str(error).lower()
