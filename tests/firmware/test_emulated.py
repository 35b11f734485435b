"""The firmware on an emulated Cortex-M4F: the bits of this computer's program, in the loop, and with a lost host."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from firmware_cases import (
    assert_cools_and_waits_for_re_arming,
    at_port,
    board,
    emulator,
    host_board,
    kill_a_host_that_heats,
    mps2_image,
)
from wire_cases import summary_of

from rtctl.border.records import VO2
from rtctl.border.wire.serial_frames import Layout, Request, Settings, frame, settings_payload
from rtctl.cli import main

pytestmark = pytest.mark.wire


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The image of the emulated board."""
    return mps2_image(tmp_path_factory.mktemp("emulated") / "firmware")


@contextmanager
def emulated_terminal(image: Path) -> Iterator[str]:
    """The emulated board; yields the pseudo-terminal that is its serial line."""
    with subprocess.Popen(emulator(image, "pty"), stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            told = process.stdout.readline()
            found = re.search(r"/dev/pts/\d+", told)
            assert found, told
            yield found.group()
        finally:
            process.kill()


def assert_same_bits(image: Path, machine: str, host: Path) -> None:
    """Whole and minor loops in lockstep, limits, and leases that end inside a sample."""
    rng = np.random.default_rng(386)
    levels = np.repeat(rng.uniform(0.0, 9.0, 60), rng.integers(1, 8, 60))
    requests = [
        frame(Request.IDENTIFY, 0),
        frame(Request.SETTINGS, 1, settings_payload(Settings(1, 1, 2, 1000))),
        *(frame(Request.COMMAND, tag, Layout(VO2).command([level])) for tag, level in enumerate(levels)),
        frame(Request.SETTINGS, 1, settings_payload(Settings(1, 1, 1, 5000))),
        *(frame(Request.COMMAND, tag, Layout(VO2).command([8.0])) for tag in (1000, 1001)),
    ]
    with board(emulator(image, "stdio", machine)) as emulated, board(host_board(host)) as program:
        for request in requests:
            assert emulated.answer(request) == program.answer(request), request.hex(" ")


def test_it_computes_the_bits_of_the_program_of_this_computer(image: Path, host_firmware: Path) -> None:
    assert_same_bits(image, "mps2-an386", host_firmware)


def test_a_processor_without_floating_point_computes_the_same_bits(
    host_firmware: Path, tmp_path: Path
) -> None:
    image = mps2_image(tmp_path / "firmware", "ARM=-mcpu=cortex-m3 -mthumb")
    assert_same_bits(image, "mps2-an385", host_firmware)


def test_a_model_of_the_same_device_tracks_steps_on_it(image: Path, model_file: Path, tmp_path: Path) -> None:
    with emulated_terminal(image) as port:
        words = [
            "--set",
            "driver.kind=serial",
            "--set",
            f"driver.port={port}",
            "--set",
            "scenario.duration=1 s",
        ]
        out = ["--out", str(tmp_path / "run"), "--quiet"]
        assert main(["run", "steps", "--model", str(model_file), *words, *out]) == 0
    assert summary_of(tmp_path / "run")["verdict"] == "pass"


@pytest.mark.slow
def test_a_host_that_is_killed_leaves_a_film_that_cools_and_waits_to_be_re_armed(
    image: Path, tmp_path: Path
) -> None:
    with emulated_terminal(image) as port:
        kill_a_host_that_heats(port, tmp_path)
        with at_port(port) as device:
            assert_cools_and_waits_for_re_arming(device)
