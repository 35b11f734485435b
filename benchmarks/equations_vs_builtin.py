"""Time a step of the oscillator in equations beside the built-in one's Runge-Kutta steps, in one run; and first use.

The same with an event that never takes place, and with a stop that turns the motion back.

python benchmarks/equations_vs_builtin.py
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from ratio import Ratio

from plant_sim.equations.compiled.kernels import march
from plant_sim.equations.integration.steps import Plan
from plant_sim.equations.reading import read_equations, system_of
from plant_sim.oscillator.equation.terms import nominal
from plant_sim.oscillator.integration.rk4 import bind_rk4

MODEL = Path(__file__).resolve().parents[1] / "scenarios" / "models" / "equations" / "oscillator.toml"
STEPS, SUBSTEPS, ROUNDS = 20_000, 20, 300
"""Runs of 2 ms, many of them: with other work on the machine each run of 20 ms is interrupted, and none is clean."""
NEAR, FAR = 0.004, 1000.0
"""Places [mm] of a stop."""
EVENT = """
[model.events.stop]
when = "z - {level} * unit"
direction = "rising"
set = { v = "-v" }
"""
FIRST_USE = """
import sys, time
import numpy as np
from pathlib import Path
from plant_sim.equations.model import equations_simulation
from plant_sim.equations.reading import read_equations
from rtctl.border.simulation import Stimulus
begun = time.perf_counter()
model = read_equations(Path(sys.argv[1]))
one = equations_simulation(model, {"drive": "V", "displacement": "mm"}, "model")
u = Stimulus(inputs={"drive": np.ones(100)}, holds={"drive": "zero"}, period_s=1e-3)
one.predict(u, np.array([p.value for p in one.parameters]))
print(time.perf_counter() - begun)
"""


def per_step(function) -> float:
    """Return nanoseconds a step, the least of several rounds."""
    begun = time.perf_counter()
    function()
    return 1e9 * (time.perf_counter() - begun) / STEPS


def with_event(folder: Path, level: float):
    """Return the oscillator with a stop at `level` mm, which turns it back."""
    text = MODEL.read_text(encoding="utf-8") + 'unit = { value = 1.0, unit = "mm" }\n'
    path = folder / "event.toml"
    path.write_text(text + EVENT.replace("{level}", repr(level)), encoding="utf-8")
    return system_of(read_equations(path), "oscillator")


def passages(system, nodes) -> int:
    """Return how often the speed of a run changes its sign beside the stop."""
    p = np.array([[one.value * one.factor] for one in system.parameters])
    z, v = march(system, np.zeros((2, 1)), nodes, 1e-4, Plan(1, implicit=False), p)[:, :, 0].T
    return int(np.count_nonzero((v[:-1] > 0.0) & (v[1:] < 0.0) & (z[1:] > 0.98e-3 * NEAR)))


class Costs(NamedTuple):
    """Nanoseconds a step, the least of the rounds."""

    equations: float
    far: float
    """With an event that never takes place."""
    near: float
    """With a stop that turns the motion back."""
    built_in: float


def ratios(rounds: int) -> list[Ratio]:
    """The oscillator in equations beside the built-in one."""
    found = []
    for lanes in (1, 16):
        cost = costs(Systems.read(), lanes, 10 * rounds)
        text = "one lane" if lanes == 1 else f"{lanes} lanes"
        found.append(
            Ratio(f"equations, {text}, a step", "built-in oscillator", cost.equations, cost.built_in, "ns")
        )
    return found


class Systems(NamedTuple):
    """The oscillator in equations: alone, and with stops."""

    alone: Any
    far: Any
    near: Any

    @classmethod
    def read(cls) -> Systems:
        """Of the model file."""
        with tempfile.TemporaryDirectory() as folder:
            far, near = (with_event(Path(folder), level) for level in (FAR, NEAR))
        return cls(system_of(read_equations(MODEL), "oscillator"), far, near)


def drive() -> np.ndarray:
    """At the nodes of each step."""
    return np.random.default_rng(0).standard_normal((STEPS, 3))


def costs(systems: Systems, lanes: int, rounds: int) -> Costs:
    """All four by turns in so many lanes."""
    built_in = bind_rk4(nominal, 0)
    values = [4.0, 8882.6, 6e5, 300.0]
    nodes = drive()
    own = np.ascontiguousarray(nodes.T[:, :, None])
    p = np.array([[one.value * one.factor] * lanes for one in systems.alone.parameters])
    rows = np.array([[values[k]] * lanes for k in (3, 0, 1, 2)])
    out = np.empty((2, STEPS // SUBSTEPS + 1, lanes))
    with_unit = np.vstack((p, np.full((1, lanes), 1e-3)))

    def marched(system: Any, parameters: np.ndarray) -> Callable[[], Any]:
        plan = Plan(SUBSTEPS, implicit=False)
        return lambda: march(system, np.zeros((2, lanes)), own, 1e-4 * SUBSTEPS, plan, parameters)

    def of_built_in() -> None:
        start = np.zeros(lanes), np.zeros(lanes), np.empty((0, lanes))
        built_in(*start, nodes, 1e-4, SUBSTEPS, rows, out[0], out[1])

    calls = (
        marched(systems.alone, p), marched(systems.far, with_unit), marched(systems.near, with_unit), of_built_in
    )  # fmt: skip
    times = np.array([[per_step(one) for one in calls] for _ in range(rounds)])[1:].min(axis=0)
    return Costs(*times.tolist())


def main() -> None:
    """Print the tables."""
    systems = Systems.read()
    for lanes in (1, 4, 8, 16):
        cost = costs(systems, lanes, ROUNDS)
        print(
            f"{lanes:3d} lanes: equations {cost.equations:6.1f} ns, built-in {cost.built_in:6.1f} ns, "
            f"ratio {cost.equations / cost.built_in:.2f}; an event that is far {cost.far:6.1f} ns, "
            f"that takes place {cost.near:6.1f} ns"
        )
    own = np.ascontiguousarray(drive().T[:, :, None])
    print(f"the stop turns the motion back in {passages(systems.near, own)} of {STEPS} steps")
    with tempfile.TemporaryDirectory() as folder:
        text = MODEL.read_text(encoding="utf-8").replace(
            "2)*z", f"2)*z + 0*{time.time_ns() % 10**9}*v*damping"
        )
        path = Path(folder) / "new.toml"
        path.write_text(text, encoding="utf-8")
        for word in ("first", "second"):
            done = subprocess.run(
                [sys.executable, "-c", FIRST_USE, str(path)], capture_output=True, text=True, check=True
            )
            print(
                f"{word} use of a new model in a new process: {float(done.stdout):.2f} s from file to result"
            )


if __name__ == "__main__":
    main()
