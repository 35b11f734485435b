"""Each test registers into a registry of its own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from rtctl.registry import forgetting
from rtctl.registry.loading import PLUGINS


@pytest.fixture(autouse=True)
def _forgotten(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv(PLUGINS, "")
    with forgetting():
        yield


@pytest.fixture(scope="session")
def own_parts() -> Path:
    """A plugin file with a plant, a controller and an estimator of a user."""
    return Path(__file__).parent / "own_heater.py"
