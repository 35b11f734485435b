"""Fixtures of the whole suite: bundled devices, identified once a session for all workers."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from firmware_cases import host_program
from vo2_cases import IdentifiedDevice, identified_device

from rtctl.models.vo2 import write_model

# A worker of the suite keeps so many objects that to look through them for cycles costs a twentieth of its time.
gc.set_threshold(100_000, 50, 100)


@pytest.fixture(scope="session")
def identified(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], IdentifiedDevice]:
    """`identified("vo2_a")`: its data, its model, and a staircase that no fit has seen."""
    session = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        session = session.parent  # the workers' common folder
    folder = Path(session) / "identified"
    folder.mkdir(exist_ok=True)
    return cache(lambda name: identified_device(name, folder))


@pytest.fixture(scope="session")
def model_file(
    identified: Callable[[str], IdentifiedDevice], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """The model of vo2_a, as `rtctl run --model` takes it."""
    path = tmp_path_factory.mktemp("model") / "vo2_a.toml"
    write_model(identified("vo2_a").model, path)
    return path


@pytest.fixture(scope="session")
def host_firmware(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The firmware with the film of vo2_a as a program of this computer."""
    return host_program(tmp_path_factory.mktemp("host") / "firmware")
