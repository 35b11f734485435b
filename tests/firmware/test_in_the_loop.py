"""The loop drives the firmware of this computer: acquire, identify, run; and a host that is lost."""

from __future__ import annotations

from pathlib import Path

import pytest
from firmware_cases import (
    assert_cools_and_waits_for_re_arming,
    at_port,
    board,
    host_board,
    kill_a_host_that_heats,
    on_terminal,
    wait_until,
)
from wire_cases import summary_of

from rtctl.border.records import VO2, DeviceStatus
from rtctl.border.wire.serial_frames import (
    FrameReader,
    Layout,
    Request,
    Settings,
    frame,
    settings_payload,
)
from rtctl.cli import main

pytestmark = pytest.mark.wire

SHORT = ("--set", "scenario.duration=1 s")


def test_a_model_of_the_same_device_tracks_steps_on_the_firmware(
    model_file: Path, host_firmware: Path, tmp_path: Path
) -> None:
    with on_terminal(host_firmware, tmp_path / "film") as wire:
        out = ("--out", str(tmp_path / "run"))
        assert main(["run", "steps", "--model", str(model_file), *wire, *SHORT, *out, "--quiet"]) == 0
    summary = summary_of(tmp_path / "run")
    assert summary["verdict"] == "pass", "its check is 1 % of the range"
    assert summary["timing"]["steps"] == 1000


@pytest.mark.slow
def test_a_model_that_was_identified_on_the_firmware_tracks_sines_on_it(
    host_firmware: Path, tmp_path: Path
) -> None:
    model = tmp_path / "model.toml"
    with on_terminal(host_firmware, tmp_path / "film") as wire:
        assert main(["acquire", "acquire_vo2", *wire, "--out", str(tmp_path / "data"), "--quiet"]) == 0
        assert (
            main(["identify", str(tmp_path / "data" / "dataset.toml"), "--out", str(model), "--quiet"]) == 0
        )
        for scenario in ("multisine_1_10hz", "random_staircase", "sine_1hz"):
            out = ("--out", str(tmp_path / scenario))
            assert main(["run", scenario, "--model", str(model), *wire, *out, "--quiet"]) == 0
            assert summary_of(tmp_path / scenario)["verdict"] == "pass"


def test_a_host_that_is_killed_leaves_a_film_that_cools_and_waits_to_be_re_armed(
    host_firmware: Path, tmp_path: Path
) -> None:
    with on_terminal(host_firmware, tmp_path / "film"):
        kill_a_host_that_heats(tmp_path / "film", tmp_path)
        with at_port(tmp_path / "film") as device:
            assert_cools_and_waits_for_re_arming(device)


def test_a_line_that_babbles_keeps_no_lease_alive(host_firmware: Path) -> None:
    command = Layout(VO2).command([8.0])
    with board(host_board(host_firmware)) as device:
        device.ask(Request.SETTINGS, 1, settings_payload(Settings(1, 0, 50, 1000)))
        device.ask(Request.COMMAND, 2, command)
        repeated = frame(Request.COMMAND, 2, command) + bytes(range(1, 256))

        def status() -> int:
            reading = Layout(VO2).measurement(FrameReader().feed(device.answer(repeated))[0].payload)
            assert reading is not None
            return reading.status

        wait_until(
            lambda: status() & DeviceStatus.WATCHDOG_TRIPPED, "repeats of a command feed the watchdog:"
        )


def test_a_host_that_reads_no_answers_does_not_stop_the_board(host_firmware: Path, tmp_path: Path) -> None:
    requests = 20_000 * frame(Request.READ, 3)  # their answers are many times what the line holds
    with (
        on_terminal(host_firmware, tmp_path / "film"),
        at_port(tmp_path / "film") as device,
    ):
        for at in range(0, len(requests), 1000):
            device.send(requests[at : at + 1000])  # fails where the board takes no more bytes
