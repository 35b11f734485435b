"""Stiff equations that begin at zero, where a state has no size by which to take its slope."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import own_devices

from plant_sim.equations.compiled.kernels import march
from plant_sim.equations.integration.steps import Plan
from plant_sim.equations.reading import read_equations, system_of


def test_what_decays_at_once_is_done_with_after_one_implicit_step_from_zero(tmp_path: Path) -> None:
    """x' = fast (u - x), y' = slow (x - y): x is u after a step of a thousand of its time constants, y the lag of u."""
    path = tmp_path / "fast.toml"
    path.write_text(own_devices.FAST, encoding="utf-8")
    system = system_of(read_equations(path), "fast")
    p = np.array([[one.value * one.factor] for one in system.parameters])
    u = np.array([1.0] * 4 + [-2.0] * 4)
    nodes = np.broadcast_to(u[None, :, None], (3, 8, 1)).copy()
    x, y = march(system, np.zeros((2, 1)), nodes, 0.05, Plan(1, implicit=True), p)[:, :, 0].T
    np.testing.assert_allclose(x[1:], u, atol=1e-3)
    expected = [0.0]
    for level in u:
        expected.append(level + (expected[-1] - level) * np.exp(-0.8 * 0.05))
    np.testing.assert_allclose(y, expected, atol=3e-4)
