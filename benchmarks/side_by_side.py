"""rtctl beside what a user would pick instead, in one run: time and accuracy, on our home ground and on theirs.

    python benchmarks/side_by_side.py [--tasks NAME ...] [--silverbox FOLDER] [--rounds 3]

SciPy's solvers always; pysindy, SysIdentPy, pynamicalsys and freq-statespace where they are installed (pip install
pysindy sysidentpy pynamicalsys freq-statespace); those that are not are told. Processor seconds: the first call, which
compiles or imports, and the median of `rounds` further ones, tools by turns. Each tool is used as its own
documentation does, with the settings that the row says.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from oscillator_vs_c import PERIOD_S, nominal, random_drive, values_of
from scipy.integrate import odeint, solve_ivp
from threadpoolctl import threadpool_limits

import rtctl
from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.motion import Equation
from plant_sim.oscillator.sweep import follow
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Stimulus

FloatArray = NDArray[np.float64]
ROOT = Path(__file__).resolve().parents[1]
HEAD = "| task | tool and settings | first [s] | then [s] | accuracy |\n|---|---|---|---|---|"


class Tool(NamedTuple):
    """One way to do a task: `run` does it and is timed, `judge` says how well from what it returned."""

    name: str
    run: Callable[[], Any]
    judge: Callable[[Any], str]
    once: bool = False
    """Whether it is run only once, as it takes long."""


Tools = Iterable[Tool]


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tasks", nargs="+", choices=TASKS, default=list(TASKS))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--silverbox", type=Path, default=ROOT.parent / "shared" / "data" / "silverbox")
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    print(HEAD)
    with threadpool_limits(1, "blas"), tempfile.TemporaryDirectory() as folder:
        for name in asked.tasks:
            title, tools_of = TASKS[name]
            compare(title, tools_of(asked.silverbox if name == "silverbox" else Path(folder)), asked.rounds)


def compare(title: str, tools: Tools, rounds: int) -> None:
    """Time the tools by turns and print their rows."""
    ready, first, spent, found = list(tools), {}, {}, {}
    for turn in range(rounds + 1):
        for tool in ready:
            if turn and (tool.once or tool.name not in spent):
                continue
            begun = time.process_time()
            with contextlib.redirect_stdout(io.StringIO()):
                try:
                    result = tool.run()
                except ImportError as error:
                    found[tool.name] = f"not installed ({error.name})"
                    continue
            seconds = time.process_time() - begun
            if not turn:
                first[tool.name], spent[tool.name] = seconds, []
                found[tool.name] = tool.judge(result)
            else:
                spent[tool.name].append(seconds)
    for tool in ready:
        costs = [f"{first[tool.name]:.3g}" if tool.name in first else "", ""]
        if spent.get(tool.name):
            costs[1] = f"{median(spent[tool.name]):.3g}"
        print(f"| {title} | {tool.name} | {' | '.join(costs)} | {found[tool.name]} |", flush=True)


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


def stiff(folder: Path) -> Iterator[Tool]:
    """Van der Pol's oscillator with mu = 100 for 300 s, 3,001 rows."""
    times = np.linspace(0.0, 300.0, 3001)

    def right(t: float, y: FloatArray) -> list[float]:
        return [y[1], 100.0 * (1.0 - y[0] ** 2) * y[1] - y[0]]

    exact = odeint(right, [2.0, 0.0], times, tfirst=True, rtol=1e-11, atol=1e-13, mxstep=100_000)[:, 0]
    yield from of_equations(VAN_DER_POL, times, exact, folder)
    for method in ("Radau", "LSODA"):

        def run(method: str = method) -> FloatArray:
            return np.asarray(
                solve_ivp(right, (0.0, 300.0), [2.0, 0.0], method, times, rtol=1e-6, atol=1e-8).y[0]
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


# --- The Silverbox: freq-statespace's home ground, and that of NARMAX ---


def silverbox(folder: Path) -> Iterator[Tool]:
    """Fit the ten realisations; free runs over the three test records, no measured output fed in."""
    data = rtctl.read_dataset(folder / "dataset.toml")
    train, tests = data.records[0], data.records[1:]
    start = ROOT / "scenarios" / "models" / "silverbox_start.toml"

    def judge(simulated: Callable[[Any], FloatArray]) -> str:
        errors = []
        for one in tests:
            left = (simulated(one) - one.signals["displacement"])[50:]
            errors.append(1e3 * float(np.sqrt(np.mean(left**2))))
        return " / ".join(f"{error:.3g}" for error in errors) + " mV"

    def ours(model: Path | None) -> Callable[[], Any]:
        def run() -> Any:
            fitted = rtctl.identify(data, model=model).model
            found = rtctl.simulate(fitted, data)
            return lambda one: np.asarray(found.records[one.name].simulated["displacement"])

        return run

    yield Tool("rtctl identify, nominal model (4 parameters)", ours(None), judge)
    yield Tool("rtctl identify, cubic, quadratic, offset (6 parameters)", ours(start), judge)
    yield Tool("SysIdentPy FROLS, polynomial of degree 3, lags 2", lambda: narx(train, 2), judge)
    yield Tool("pysindy, smoothed differences, polynomial of degree 3", lambda: sindy(train), judge)
    yield Tool(
        "freq-statespace, its own example for these data", lambda: state_space(train), judge, once=True
    )


def narx(train: Any, lags: int) -> Callable[[Any], FloatArray]:
    """A polynomial NARX model by forward regression, 12 terms at most."""
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    model = FROLS(
        order_selection=True, n_info_values=12, ylag=lags, xlag=lags, info_criteria="bic",
        estimator=LeastSquares(), basis_function=Polynomial(degree=3), model_type="NARMAX",
    )  # fmt: skip
    model.fit(X=train.signals["drive"][:, None], y=train.signals["displacement"][:, None])

    def simulated(one: Any) -> FloatArray:
        measured = one.signals["displacement"][:, None]
        return np.asarray(model.predict(X=one.signals["drive"][:, None], y=measured[:lags]))[:, 0]

    return simulated


def sindy(train: Any) -> Callable[[Any], FloatArray]:
    """Displacement and its smoothed difference as states; simulated with the drive straight between samples."""
    import pysindy

    t = train.period_s * np.arange(train.samples)
    z, u = train.signals["displacement"], train.signals["drive"]
    derive = pysindy.SmoothedFiniteDifference(smoother_kws={"window_length": 5, "polyorder": 3})
    v = np.asarray(derive(z[:, None], t))[:, 0]
    scale = float(v.std() / z.std())
    model = pysindy.SINDy(
        optimizer=pysindy.STLSQ(threshold=0.02, normalize_columns=False),
        feature_library=pysindy.PolynomialLibrary(degree=3),
        differentiation_method=derive,
    )
    model.fit(np.column_stack((z, v / scale)), t=scale * t, u=u[:, None])

    coefficients = np.asarray(model.coefficients())
    powers = np.asarray(model.feature_library.powers_, dtype=np.int64)

    def simulated(one: Any) -> FloatArray:
        return free_run(coefficients, powers, one.signals["drive"], scale * train.period_s)

    return simulated


@njit
def free_run(coefficients: FloatArray, powers: NDArray[np.int64], drive: FloatArray, h: float) -> FloatArray:
    """First state (n,) of polynomial equations in two states and a drive, by Heun's rule; infinite once it diverges."""
    out = np.full(drive.size, np.inf)
    state, slopes, out[0] = np.zeros(2), np.zeros((2, 2)), 0.0
    for k in range(drive.size - 1):
        for turn in range(2):
            here = state + h * turn * slopes[0]
            slopes[turn] = 0.0
            for j in range(powers.shape[0]):
                term = here[0] ** powers[j, 0] * here[1] ** powers[j, 1] * drive[k + turn] ** powers[j, 2]
                slopes[turn] += coefficients[:, j] * term
        state = state + 0.5 * h * (slopes[0] + slopes[1])
        if not np.abs(state).max() < 1e3:
            break
        out[k + 1] = state[0]
    return out


def state_space(train: Any) -> Callable[[Any], FloatArray]:
    """The example of freq-statespace: linear, then inference and learning, then 100 iterations in time."""
    import freq_statespace as fss

    samples, realisations, rate_hz = 8192, 6, 1e7 / 2**14
    u, y = train.signals["drive"], train.signals["displacement"]
    u_of, y_of = (np.zeros((samples, 1, realisations, 1)) for _ in range(2))
    at = FIRST_OF_TRAINING
    for k in range(realisations):
        u_of[:, 0, k, 0], y_of[:, 0, k, 0] = u[at : at + samples], y[at : at + samples]
        at += samples + 500
    data = fss.create_data_object(u_of, y_of, np.arange(1, 2 * 1342, 2), rate_hz)
    linear = fss.lin.optimize(fss.lin.subspace_id(data, 2), data)
    model = fss.nonlin.inference_and_learning(linear, data, fss.static.basis.Polynomial(1, degree=3), 1)
    model = fss.nonlin.optimize(model, data)
    return lambda one: np.asarray(model.simulate(one.signals["drive"])[0])[:, 0]


FIRST_OF_TRAINING = 164
"""First sample of the first realisation's period."""


# --- Equations from states that were measured: pysindy's home ground ---

LORENZ = """
[model]
kind = "equations"
[model.states]
x = { unit = "1", rate = "sigma*(y - x)", initial = -8.0 }
y = { unit = "1", rate = "(x*(rho - z) - y)*unit", initial = 8.0 }
z = { unit = "1", rate = "x*y*unit - beta*z", initial = 27.0 }
[model.outputs]
x = { unit = "1", value = "x" }
y = { unit = "1", value = "y" }
z = { unit = "1", value = "z" }
[model.parameters]
sigma = { value = 8.0, unit = "1/s", low = 0 }
rho = { value = 24.0, unit = "1", low = 0 }
beta = { value = 2.0, unit = "1/s", low = 0 }
unit = { value = 1.0, unit = "1/s", fixed = true }
"""


def lorenz(folder: Path) -> Iterator[Tool]:
    """10 s of Lorenz's system, 2 ms apart, 0.1 % of noise on each state."""
    t = 0.002 * np.arange(5001)

    def right(at: float, s: FloatArray) -> list[float]:
        return [10.0 * (s[1] - s[0]), s[0] * (28.0 - s[2]) - s[1], s[0] * s[1] - 8.0 / 3.0 * s[2]]

    clean = solve_ivp(right, (0.0, 10.0), [-8.0, 8.0, 27.0], "DOP853", t, rtol=1e-10, atol=1e-10).y.T
    measured = clean + 0.001 * clean.std(axis=0) * np.random.default_rng(0).standard_normal(clean.shape)
    true = np.array([10.0, 28.0, 8.0 / 3.0])

    def judge(found: FloatArray) -> str:
        return f"sigma, rho, beta off by {np.abs(found / true - 1.0).max():.0e} at most"

    def theirs() -> FloatArray:
        import pysindy

        model = pysindy.SINDy(
            optimizer=pysindy.STLSQ(threshold=0.2),
            differentiation_method=pysindy.SmoothedFiniteDifference(
                smoother_kws={"window_length": 21, "polyorder": 3}
            ),
        )
        model.fit(measured, t=t)
        c, names = np.asarray(model.coefficients()), model.get_feature_names()
        return np.array([c[0, names.index("x1")], c[1, names.index("x0")], -c[2, names.index("x2")]])

    def ours() -> FloatArray:
        path = folder / "lorenz.toml"
        path.write_text(LORENZ, encoding="utf-8")
        signals = dict(zip("xyz", measured.T, strict=True))
        record = rtctl.Record(name="a", period_s=0.002, use="fit", signals=signals)
        data = rtctl.write_dataset(
            folder / "lorenz", [record], name="lorenz", plant="equations", units=dict.fromkeys("xyz", "1")
        )
        fitted = rtctl.identify(data, model=path).model.parameters
        return np.array([fitted[name].value for name in ("sigma", "rho", "beta")])

    yield Tool("pysindy STLSQ, quadratic library: finds the equations", theirs, judge)
    yield Tool("rtctl identify: the equations are given, parameters start 15 to 25 % off", ours, judge)


TASKS: dict[str, tuple[str, Callable[[Path], Iterator[Tool]]]] = {
    "sampled-drive": ("simulate a sampled drive, 2,000 samples", sampled_drive),
    "smooth": ("a smooth orbit, 100 s", smooth),
    "stiff": ("a stiff one: van der Pol, mu = 100, 300 s", stiff),
    "ensemble": ("100 starts, 200 periods of drive", ensemble),
    "silverbox": ("identify the Silverbox", silverbox),
    "lorenz": ("equations of Lorenz's system from its states", lorenz),
}


if __name__ == "__main__":
    main()
