"""Policies at work while the wire has faults: each level at the device is safe, and what was asked is done."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))

import policy_faults  # noqa: E402


@pytest.mark.wire
@pytest.mark.parametrize(("policy", "kind"), [("derate", "drop"), ("stop", "stall"), ("retune", "bit_flip")])
def test_a_policy_acts_while_the_wire_has_faults(
    policy: str, kind: str, model_file: Path, tmp_path: Path
) -> None:
    found = policy_faults.case(kind, policy, model_file, tmp_path, turn=0)
    assert found["unsafe"] == []
    assert found["wrong"] == []
    assert found["done"].startswith(
        {"derate": "derate: controller.kp", "stop": "stop: ", "retune": "PI: "}[policy]
    )
    if policy == "retune":
        assert found["models"] == [1, 0]
