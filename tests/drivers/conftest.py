"""Both forms of an exchange: compiled, and in Python, which is its oracle."""

from __future__ import annotations

import pytest

from drivers.compiled import exchange


@pytest.fixture(params=["compiled", "in Python"])
def either_form(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """A driver of this test takes the one, then the other."""
    if request.param == "compiled" and not exchange.AVAILABLE:
        pytest.skip("this machine has no compiled exchange")
    monkeypatch.setattr(exchange, "AVAILABLE", request.param == "compiled")
    return str(request.param)
