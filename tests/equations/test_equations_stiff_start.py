"""Stiff equations that begin at zero, where a state has no size by which to take its slope."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import own_devices
import pytest

from plant_sim.equations.compiled.kernels import march
from plant_sim.equations.integration.inputs import input_nodes
from plant_sim.equations.integration.steps import Plan
from plant_sim.equations.marching import Marching
from plant_sim.equations.reading import read_equations, system_of
from rtctl.border.simulation import Stimulus


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


def test_what_steps_do_not_resolve_is_told_with_its_state_and_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two states, of which only the slow one still changes when steps are halved, from a jump of the input on."""
    path = tmp_path / "fast.toml"
    path.write_text(own_devices.FAST, encoding="utf-8")
    system = system_of(read_equations(path), "fast")
    u = np.where(np.arange(40) < 12, 0.0, 1.0)
    stimulus = Stimulus(
        inputs={system.inputs[0].name: u}, holds={system.inputs[0].name: "zero"}, period_s=0.05
    )
    p = np.array([[one.value * one.factor] for one in system.parameters])
    marching = Marching(
        system, stimulus, lambda steps: input_nodes(stimulus, system, np.ones(1), steps), np.zeros((2, 1)), p,
        np.zeros(len(p)), uniform=True,
    )  # fmt: skip
    assert marching.resolve().implicit
    monkeypatch.setattr("plant_sim.equations.marching.CONVERGED", 1e-30)
    again = marching._replace(stimulus=dataclasses.replace(stimulus))
    with pytest.raises(
        ValueError, match=r"do not resolve the state (\w+): .* % of its swing, from ([\d.]+) s on\. "
    ) as said:
        again.resolve()
    at_s = float(str(said.value).partition(" swing, from ")[2].partition(" s on")[0])
    assert at_s >= 0.55, "before the jump nothing moves"
