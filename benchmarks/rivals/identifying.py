"""Identification: the Silverbox and Lorenz's system; freq-statespace, SysIdentPy and pysindy beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import rtctl
from rivals.tool import Tool

FloatArray = NDArray[np.float64]
ROOT = Path(__file__).resolve().parents[2]

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
