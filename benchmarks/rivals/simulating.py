"""Simulation: a sampled drive, a smooth orbit, a stiff one, many starts; SciPy and pynamicalsys beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from oscillator_vs_c import PERIOD_S, nominal, random_drive, values_of
from scipy.integrate import odeint, solve_ivp

from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.motion import Equation
from plant_sim.oscillator.sweep import follow
from rivals.tool import Tool
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Stimulus

FloatArray = NDArray[np.float64]

# --- Simulation of a sampled drive: our home ground ---


def sampled_drive(folder: Path) -> Iterator[Tool]:
    """A hardening oscillator under 2,000 samples of random drive, straight between them."""
    simulation, drive = nominal(), 2.0 * random_drive(2000)
    times = PERIOD_S * np.arange(drive.size)
    damping, stiffness, cubic, gain = values = values_of(simulation)
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)

    def force(t: float, y: FloatArray, u: Callable[[float], float]) -> list[float]:
        return [y[1], gain * u(t) - damping * y[1] - (stiffness + cubic * y[0] ** 2) * y[0]]

    def between(t: float) -> float:
        return float(np.interp(t, times, drive))

    @njit
    def compiled(t: float, y: FloatArray) -> FloatArray:
        k = min(int(t / PERIOD_S), drive.size - 2)
        u = drive[k] + (drive[k + 1] - drive[k]) * (t / PERIOD_S - k)
        return np.array([y[1], gain * u - damping * y[1] - (stiffness + cubic * y[0] ** 2) * y[0]])

    exact = segment_by_segment(force, times, drive)
    span = (0.0, times[-1])

    def solved(right: Callable[..., Any], method: str, rtol: float) -> Callable[[], FloatArray]:
        def run() -> FloatArray:
            found = solve_ivp(
                right, span, [0.0, 0.0], method=method, t_eval=times, rtol=rtol, atol=1e-3 * rtol
            )
            return np.asarray(found.y[0])

        return run

    def judge(z: FloatArray) -> str:
        return f"largest error {np.abs(z - exact).max() / np.abs(exact).max():.0e} of the motion"

    def by_interp(t: float, y: FloatArray) -> list[float]:
        return force(t, y, between)

    yield Tool("rtctl", lambda: simulation.predict(stimulus, values).outputs["displacement"].ravel(), judge)
    yield Tool("SciPy solve_ivp RK45, rtol 1e-3 (default), np.interp", solved(by_interp, "RK45", 1e-3), judge)
    yield Tool("SciPy solve_ivp DOP853, rtol 1e-6, np.interp", solved(by_interp, "DOP853", 1e-6), judge)
    yield Tool("SciPy solve_ivp LSODA, rtol 1e-6, np.interp", solved(by_interp, "LSODA", 1e-6), judge)
    yield Tool(
        "SciPy solve_ivp LSODA, rtol 1e-6, right-hand side by Numba", solved(compiled, "LSODA", 1e-6), judge
    )
    yield Tool(
        "SciPy odeint (LSODA), rtol 1e-8, right-hand side by Numba",
        lambda: odeint(compiled, [0.0, 0.0], times, tfirst=True, rtol=1e-8, atol=1e-11)[:, 0],
        judge,
    )


def segment_by_segment(force: Callable[..., Any], times: FloatArray, drive: FloatArray) -> FloatArray:
    """Displacement by DOP853 at rtol 1e-11, begun anew at each sample: no step crosses a kink of the drive."""
    state, out = np.zeros(2), [0.0]
    for k in range(len(times) - 1):

        def straight(t: float, k: int = k) -> float:
            return float(drive[k] + (drive[k + 1] - drive[k]) * (t - times[k]) / PERIOD_S)

        state = solve_ivp(
            lambda t, y, u=straight: force(t, y, u),
            (times[k], times[k + 1]),
            state,
            "DOP853",
            rtol=1e-11,
            atol=1e-14,
        ).y[:, -1]
        out.append(float(state[0]))
    return np.array(out)


# --- A smooth orbit to many digits, and a stiff one: SciPy's home ground ---

PENDULUM = """
[model]
kind = "equations"
[model.states]
z = { unit = "1", rate = "v", initial = 1.0 }
v = { unit = "1/s", rate = "-k*z - c*z^3" }
[model.outputs]
displacement = { unit = "1", value = "z" }
[model.parameters]
k = { value = 1.0, unit = "1/s^2" }
c = { value = 1.0, unit = "1/s^2" }
"""


def smooth(folder: Path) -> Iterator[Tool]:
    """A free Duffing oscillator without damping for 100 s, 201 rows, as exact as can be."""
    times = np.linspace(0.0, 100.0, 201)

    def right(t: float, y: FloatArray) -> list[float]:
        return [y[1], -y[0] - y[0] ** 3]

    exact = solve_ivp(right, (0.0, 100.0), [1.0, 0.0], "DOP853", times, rtol=3e-14, atol=1e-15).y[0]
    yield from of_equations(PENDULUM, times, exact, folder)

    def solved(method: str, rtol: float) -> Tool:
        def run() -> FloatArray:
            return np.asarray(
                solve_ivp(right, (0.0, 100.0), [1.0, 0.0], method, times, rtol=rtol, atol=rtol).y[0]
            )

        return Tool(f"SciPy solve_ivp {method}, rtol {rtol:.0e}", run, lambda z: error_of(z, exact))

    yield solved("DOP853", 1e-6)
    yield solved("DOP853", 1e-11)
    yield solved("LSODA", 1e-6)


VAN_DER_POL = """
[model]
kind = "equations"
[model.states]
z = { unit = "1", rate = "v", initial = 2.0 }
v = { unit = "1/s", rate = "mu*(1 - z^2)*v - w*z" }
[model.outputs]
displacement = { unit = "1", value = "z" }
[model.parameters]
mu = { value = 100.0, unit = "1/s" }
w = { value = 1.0, unit = "1/s^2" }
"""


def stiff(folder: Path, mu: float = 100.0) -> Iterator[Tool]:
    """Van der Pol's oscillator for 3 mu seconds, 3,001 rows."""
    end_s = 3.0 * mu
    times = np.linspace(0.0, end_s, 3001)

    def right(t: float, y: FloatArray) -> list[float]:
        return [y[1], mu * (1.0 - y[0] ** 2) * y[1] - y[0]]

    exact = odeint(right, [2.0, 0.0], times, tfirst=True, rtol=1e-11, atol=1e-13, mxstep=1_000_000)[:, 0]
    yield from of_equations(VAN_DER_POL.replace("100.0", repr(mu)), times, exact, folder)
    for method in ("Radau", "LSODA"):

        def run(method: str = method) -> FloatArray:
            return np.asarray(
                solve_ivp(right, (0.0, end_s), [2.0, 0.0], method, times, rtol=1e-6, atol=1e-8).y[0]
            )

        yield Tool(f"SciPy solve_ivp {method}, rtol 1e-6", run, lambda z: error_of(z, exact))


def of_equations(text: str, times: FloatArray, exact: FloatArray, folder: Path) -> Iterator[Tool]:
    """Rtctl on a model file without inputs."""
    from plant_sim.equations.model import equations_simulation
    from plant_sim.equations.reading import read_equations

    path = folder / "model.toml"
    path.write_text(text, encoding="utf-8")
    simulation = equations_simulation(read_equations(path), {"displacement": "1"}, "benchmark")
    values = np.array([one.value for one in simulation.parameters])
    stimulus = Stimulus(inputs={}, holds={}, period_s=float(times[1] - times[0]), count=len(times))
    yield Tool(
        "rtctl, equations", lambda: simulation.predict(stimulus, values).outputs["displacement"].ravel(),
        lambda z: error_of(z, exact),
    )  # fmt: skip


def error_of(z: FloatArray, exact: FloatArray) -> str:
    """The median over rows: a phase error makes single rows of a relaxation oscillation as wrong as they can be."""
    wrong = np.abs(z - exact) / np.abs(exact).max()
    return f"median error {np.median(wrong):.0e}, largest {wrong.max():.0e} of the motion"


# --- Many starts of a forced Duffing oscillator: pynamicalsys's home ground ---

STARTS, PERIODS, STEPS = 100, 200, 128
DUFFING = {"delta": 0.3, "alpha": 1.0, "beta": 1.0, "gamma": 0.37, "omega": 1.2}


def ensemble(folder: Path) -> Iterator[Tool]:
    """100 starts, 200 periods, Runge-Kutta of order 4 with 128 steps a period in both."""
    starts = np.random.default_rng(0).uniform(-1.0, 1.0, (STARTS, 2))
    delta, alpha, beta, gamma, omega = DUFFING.values()
    numbers = {
        "damping": (delta, "1/s"), "stiffness": (-alpha, "1/s^2"), "stiffness_cubic": (beta, "1/(V^2*s^2)"),
        "drive_gain": (1.0, "1/s^2"),
    }  # fmt: skip
    parameters = {name: {"value": value, "unit": unit} for name, (value, unit) in numbers.items()}
    model = ModelFile.model_validate({"model": {"kind": "oscillator", "parameters": parameters}})
    simulation = oscillator_simulation(model, {"drive": "V", "displacement": "V"}, "benchmark")
    equation = Equation.of(simulation.parameters, [], np.tile(values_of(simulation), (STARTS, 1)))

    def ours() -> FloatArray:
        found = follow(equation, starts, gamma, omega / (2.0 * np.pi), PERIODS, steps_per_period=STEPS)
        return np.column_stack((found.displacement[-1], found.velocity[-1]))

    def theirs() -> FloatArray:
        from pynamicalsys import ContinuousDynamicalSystem

        system = ContinuousDynamicalSystem(model="duffing")
        period = 2.0 * np.pi / omega
        system.integrator("rk4", time_step=period / STEPS)
        rows = system.trajectory(starts, PERIODS * period, parameters=list(DUFFING.values()))
        return np.asarray(rows)[:, -1, 1:]

    exact: list[FloatArray] = []

    def judge(ends: FloatArray) -> str:
        exact.append(ends)
        far = np.median(np.abs(ends - exact[0]).max(axis=1))
        return (
            "the reference of this task"
            if len(exact) == 1
            else f"median start differs by {far:.0e} at the end"
        )

    yield Tool(f"rtctl sweep kernel, {STEPS} steps a period", ours, judge)
    yield Tool(f"pynamicalsys rk4, {STEPS} steps a period", theirs, judge)
