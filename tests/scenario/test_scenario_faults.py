"""Faults through the whole program: safe current, exit 1, verdict "fault" with its name, the recording written."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from wire_cases import WatchedDevice, served_process, served_thread, settings, signals_of, summary_of

from drivers.inprocess import InProcessDriver
from rtctl.border.errors import DriverError, Fault
from rtctl.border.records import DeviceStatus, Driver, Measurement
from rtctl.cli import main
from rtctl.estimators.observer import ObserverEstimator
from rtctl.interfaces import Estimate
from rtctl.models.vo2 import Vo2Model
from rtctl.scenario.schema import Scenario
from rtctl.wiring import build_driver

SAFE_MA = 3.68
SETTLE = 50
AT = 30  # the sample at which it happens

Change = Callable[[Measurement], Measurement]


@pytest.fixture(autouse=True)
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """They take most of a short run's time."""
    monkeypatch.setattr("rtctl.session.run_files.draw_run", lambda path, scenario, result: None)


class FaultyDevice(WatchedDevice):
    """A real simulated device whose answer to one command is not what it measured."""

    def __init__(self, change: Change) -> None:
        super().__init__()
        self._change = change

    def exchange(self, levels: Sequence[float], sequence: int) -> Measurement:
        reading = super().exchange(levels, sequence)
        return self._change(reading) if len(self.commands) == SETTLE + AT + 1 else reading


def status(bits: DeviceStatus) -> Change:
    return lambda reading: reading._replace(status=int(bits))


def raising(fault: Fault) -> Change:
    def change(reading: Measurement) -> Measurement:
        raise DriverError(fault, "as the test wants it")

    return change


ENABLED = DeviceStatus.ENABLED
CHANGES: dict[str, Change] = {
    "not_finite": lambda reading: reading._replace(sensed=(math.nan,)),
    "out_of_range": lambda reading: reading._replace(sensed=(1.0,)),
    "frozen_counter": lambda reading: reading._replace(counter=reading.counter - 1),
    "watchdog_tripped": status(ENABLED | DeviceStatus.WATCHDOG_TRIPPED | DeviceStatus.REFUSED),
    "command_refused": status(ENABLED | DeviceStatus.REFUSED),
    "sensor_fault": status(ENABLED | DeviceStatus.SENSOR_FAULT),
    "not_enabled": status(DeviceStatus(0)),
    "stale_reply": lambda reading: reading._replace(sequence=reading.sequence - 1),
    "no_answer": raising(Fault.NO_ANSWER),
}


def run(model: Path, out: Path, *more: str) -> int:
    return main(["run", "steps", "--model", str(model), "--out", str(out), "--quiet", "--no-plot", *more])


@pytest.mark.parametrize("fault", CHANGES)
def test_a_fault_ends_the_run_with_its_name(
    fault: str, model_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    device = FaultyDevice(CHANGES[fault])
    monkeypatch.setattr("rtctl.wiring.build_driver", lambda scenario, folder: InProcessDriver(device))
    assert run(model_file, tmp_path) == 1
    summary = summary_of(tmp_path)
    assert summary["verdict"] == "fault"
    assert [entry["fault"] for entry in summary["faults"]] == [fault]
    assert summary["timing"]["steps"] == AT
    signals = signals_of(tmp_path)
    assert signals["index"].tolist() == list(range(AT))
    assert device.commands[SETTLE : SETTLE + AT] == signals["current"].tolist()
    assert device.commands[SETTLE + AT + 1 :] == [SAFE_MA], "the command after the fault is the safe one"
    assert not device.enabled
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err == f"rtctl run: {fault}: {summary['faults'][0]['message']}\n"


class LostEstimator:
    """The observer until sample AT, then a value that is no number."""

    surrogate = ObserverEstimator.surrogate

    def __init__(self, model: Vo2Model) -> None:
        self._observer = ObserverEstimator(model)
        self._steps = 0

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        self._steps = 0
        return self._observer.start(levels, sensed)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        self._steps += 1
        estimate = self._observer.step(levels, sensed, elapsed_s)
        return estimate._replace(value=math.nan) if self._steps == AT + 1 else estimate


def test_a_nan_of_the_estimator_never_reaches_the_device(
    model_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = WatchedDevice()
    monkeypatch.setattr("rtctl.wiring.build_driver", lambda scenario, folder: InProcessDriver(device))
    monkeypatch.setattr("rtctl.session.closed_loop.build_estimator", lambda kind, model: LostEstimator(model))
    assert run(model_file, tmp_path) == 1
    assert [entry["fault"] for entry in summary_of(tmp_path)["faults"]] == ["not_finite"]
    assert len(device.commands) == SETTLE + AT + 2
    assert all(map(math.isfinite, device.commands))
    assert device.commands[-1] == SAFE_MA
    assert len(signals_of(tmp_path)["index"]) == AT


def test_the_kernels_are_compiled_before_a_device_waits_for_them(
    model_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Compiling lasts seconds: in a live run the device's watchdog would trip at the first sample."""
    events: list[str] = []

    class NotedEstimator(ObserverEstimator):
        def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
            events.append("step")
            return super().step(levels, sensed, elapsed_s)

    class NotedDriver(InProcessDriver):
        def open(self, *, lockstep_period_us: int | None, watchdog_ms: int, timeout_s: float) -> Measurement:
            events.append("open")
            return super().open(
                lockstep_period_us=lockstep_period_us, watchdog_ms=watchdog_ms, timeout_s=timeout_s
            )

    monkeypatch.setattr("rtctl.wiring.build_driver", lambda scenario, folder: NotedDriver(WatchedDevice()))
    monkeypatch.setattr(
        "rtctl.session.closed_loop.build_estimator", lambda kind, model: NotedEstimator(model)
    )
    run(model_file, tmp_path, *settings("scenario.duration=5 ms"))
    assert "step" in events[: events.index("open")]


class Meddler:
    """A driver that calls `act` in the middle of a run, just before an exchange."""

    def __init__(self, driver: Driver, act: Callable[[], None]) -> None:
        self.profile, self.identity = driver.profile, driver.identity
        self._driver, self._act, self._exchanges = driver, act, 0

    def open(self, *, lockstep_period_us: int | None, watchdog_ms: int, timeout_s: float) -> Measurement:
        first = self._driver.open(
            lockstep_period_us=lockstep_period_us, watchdog_ms=watchdog_ms, timeout_s=timeout_s
        )
        self.identity = self._driver.identity
        return first

    def exchange(self, levels: Sequence[float]) -> Measurement:
        if self._exchanges == SETTLE + AT:
            self._act()
        self._exchanges += 1
        return self._driver.exchange(levels)

    def close(self, safe_levels: Sequence[float]) -> None:
        self._driver.close(safe_levels)


def meddled(monkeypatch: pytest.MonkeyPatch, act: Callable[[], None]) -> None:
    def build(scenario: Scenario, folder: Path) -> Driver:
        return Meddler(build_driver(scenario, folder), act)

    monkeypatch.setattr("rtctl.wiring.build_driver", build)


@pytest.mark.wire
@pytest.mark.parametrize(
    ("wire", "faults"),
    [
        ("modbus-rtu", {"no_answer", "connection_lost"}),
        ("modbus-tcp", {"connection_lost"}),
        ("serial", {"no_answer", "connection_lost"}),
    ],
)
def test_a_killed_device_ends_the_run(
    wire: str, faults: set[str], model_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with served_process("vo2_a", wire, tmp_path) as there:

        def kill() -> None:
            there.process.kill()
            there.process.wait()

        meddled(monkeypatch, kill)
        assert run(model_file, tmp_path / "out", *there.settings, *settings("clock.timeout=0.2 s")) == 1
    summary = summary_of(tmp_path / "out")
    assert summary["verdict"] == "fault"
    assert {entry["fault"] for entry in summary["faults"]} <= faults
    assert len(summary["faults"]) == 1
    assert len(signals_of(tmp_path / "out")["index"]) == AT


@pytest.mark.wire
def test_a_device_that_hangs_finds_the_safe_command_when_it_wakes_up(
    model_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with served_process("vo2_a", "modbus-tcp", tmp_path) as there:
        meddled(monkeypatch, lambda: os.kill(there.process.pid, signal.SIGSTOP))
        assert run(model_file, tmp_path / "out", *there.settings, *settings("clock.timeout=0.2 s")) == 1
        os.kill(there.process.pid, signal.SIGCONT)
        host, _, port = there.settings[-1].removeprefix("driver.address=").rpartition(":")
        settings_now = read_settings(host, int(port))
    assert [entry["fault"] for entry in summary_of(tmp_path / "out")["faults"]] == ["no_answer"]
    assert len(signals_of(tmp_path / "out")["index"]) == AT
    assert settings_now["current_mA"] == pytest.approx(SAFE_MA)
    assert settings_now["enable"] == 0


def read_settings(host: str, port: int) -> dict[str, float]:
    """Registers 0-3 of the device, by a client of its own."""
    from pymodbus.client import ModbusTcpClient

    from rtctl.border.wire.registers import words_float32

    with ModbusTcpClient(host, port=port, timeout=5.0) as client:
        words = client.read_holding_registers(0, count=4).registers
    return {"current_mA": words_float32(words[0], words[1]), "enable": words[3]}


@pytest.mark.wire
def test_ctrl_c_ends_a_live_run_safely_with_its_data_written(model_file: Path, tmp_path: Path) -> None:
    device = WatchedDevice(enough=40)
    live = settings(
        "clock.mode=live", "scenario.period=5 ms", "clock.settle=50 ms", "scenario.duration=600 s",
        "clock.timeout=5 s", "clock.watchdog=10 s",
    )  # fmt: skip
    with served_thread(device) as there:
        command = [
            "run",
            "steps",
            "--model",
            str(model_file),
            "--out",
            str(tmp_path),
            "--quiet",
            *live,
            *there,
        ]
        process = subprocess.Popen(
            [sys.executable, "-m", "rtctl", *command],
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        assert device.has_enough.wait(60.0)
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=60.0)[1]
    assert process.returncode == 1
    assert said.startswith("rtctl run: interrupted: ")
    assert said.count("\n") == 1
    summary = summary_of(tmp_path)
    assert summary["verdict"] == "fault"
    assert [entry["fault"] for entry in summary["faults"]] == ["interrupted"]
    assert summary["timing"]["steps"] == len(signals_of(tmp_path)["index"]) > 0
    assert device.commands[-1] == pytest.approx(SAFE_MA)
    assert device.commands[-2] > SAFE_MA + 0.1, "until then it was controlled"
    assert not device.enabled


@pytest.mark.wire
def test_a_watchdog_that_trips_ends_a_live_run(
    model_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The device's lease is 2 ms, the loop's period 20 ms: the device refuses, the loop names the cause."""
    device = WatchedDevice()
    with served_thread(device) as there:
        live = settings(
            "clock.mode=live", "scenario.period=20 ms", "clock.watchdog=2 ms", "clock.timeout=5 s"
        )
        assert run(model_file, tmp_path, *live, *there) == 1
    assert [entry["fault"] for entry in summary_of(tmp_path)["faults"]] == ["watchdog_tripped"]
    assert not device.enabled


def test_acquiring_keeps_the_records_before_a_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    part = '\n[[excitation]]\nkind = "levels"\nhold = "40 ms"\nlevels = ["20 %", "80 %"]\n'
    file = tmp_path / "three.toml"
    file.write_text('[scenario]\ntitle = "three"\n[clock]\nsettle = "0 s"\n' + 3 * part)
    device, opened = WatchedDevice(), 0

    class OpensTwice(InProcessDriver):
        def open(self, *, lockstep_period_us: int | None, watchdog_ms: int, timeout_s: float) -> Measurement:
            nonlocal opened
            opened += 1
            if opened == 3:
                raise DriverError(Fault.NO_ANSWER, "gone")
            return super().open(
                lockstep_period_us=lockstep_period_us, watchdog_ms=watchdog_ms, timeout_s=timeout_s
            )

    monkeypatch.setattr("rtctl.wiring.build_driver", lambda scenario, folder: OpensTwice(device))
    assert main(["acquire", str(file), "--out", str(tmp_path / "data"), "--quiet"]) == 1
    assert "gone; the 2 records before it are in" in capsys.readouterr().err
    assert len(list((tmp_path / "data").glob("r0*.parquet"))) == 2


def test_acquiring_nothing_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    device = FaultyDevice(CHANGES["out_of_range"])
    monkeypatch.setattr("rtctl.wiring.build_driver", lambda scenario, folder: InProcessDriver(device))
    assert main(["acquire", "acquire_vo2", "--out", str(tmp_path / "data"), "--quiet"]) == 1
    message = capsys.readouterr().err
    assert "out_of_range" in message
    assert "nothing was recorded" in message
    assert not (tmp_path / "data").exists()
    assert device.commands[-1] == SAFE_MA
