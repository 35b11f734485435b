"""A model's differential equations: SciPy's motion is the simulation's, linearisations are the known ones."""

from __future__ import annotations

from pathlib import Path

import control
import numpy as np
import pytest
from export.fmu_cases import oscillator, oscillator_data
from scipy.integrate import solve_ivp
from vo2_model_cases import TAU_S, small_model

import rtctl
from rtctl.border.errors import InputError

EXAMPLES = Path("scenarios/models/equations")
CASES = (
    (), ("hysteresis.bouc_wen",), ("mode.second beside", "sensor.highpass", "sensor.lag"), ("mode.second carried",),
    ("drive.lag", "drive.offset", "drive.saturation", "sensor.offset"), ("friction.coulomb smooth",),
)  # fmt: skip


@pytest.mark.parametrize(
    "cases",
    [pytest.param(one, marks=[] if k in (0, 2, 4) else pytest.mark.slow) for k, one in enumerate(CASES)],
)
def test_solve_ivp_of_an_oscillator_is_its_simulation(cases: tuple[str, ...], tmp_path: Path) -> None:
    data = oscillator_data(tmp_path, "linear")
    model = oscillator(tmp_path, *cases)
    made = rtctl.dynamics(model)
    record = data.records[0]
    t = record.period_s * np.arange(120)
    drive = {"drive": lambda at: float(np.interp(at, t, record.signals["drive"][:120]))}
    start = made.initial
    if "drive.lag" in made.states:  # a record begins with the lag at its settled share
        passed = record.signals["drive"][0] + 0.3
        start[list(made.states).index("drive.lag")] = 0.5 * passed * _langevin(passed * np.sqrt(2.0))
    run = solve_ivp(
        made.right_hand_side(drive),
        (0.0, t[-1]),
        start,
        t_eval=t,
        rtol=1e-8,
        atol=1e-10,
        max_step=record.period_s,
    )
    seen = made.read(t, run.y, drive)["displacement"]
    simulated = rtctl.simulate(model, data).records["a"].simulated["displacement"][:120]
    assert np.abs(seen - simulated).max() < 2e-5 * np.ptp(simulated)


def _langevin(x: float) -> float:
    return float(3.0 * (1.0 / np.tanh(x) - 1.0 / x) / x)


def test_the_linearised_oscillator_has_the_known_poles(tmp_path: Path) -> None:
    made = rtctl.dynamics(oscillator(tmp_path, cubic=6e5))
    z = 0.05
    system = made.linearise([z, 0.0], {"drive": (8882.6 * z + 6e5 * z**3) / 300.0})
    assert isinstance(system, control.StateSpace)
    np.testing.assert_allclose(system.A, [[0.0, 1.0], [-(8882.6 + 1.8e6 * z**2), -4.0]], rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(system.B, [[0.0], [300.0]], rtol=1e-8, atol=1e-9)
    assert (system.input_labels, system.output_labels) == (["drive"], ["displacement", "velocity"])
    at_rest = made.rest({"drive": (8882.6 * z + 6e5 * z**3) / 300.0})
    np.testing.assert_allclose(at_rest, [z, 0.0], atol=1e-9)


def test_a_device_that_moves_by_nanometres_is_linearised_in_metres(tmp_path: Path) -> None:
    """The cubic term is as large as the linear one at 2 nm; a step of a micrometre would see nothing else."""
    model = tmp_path / "nano.toml"
    model.write_text(
        '[model]\nkind = "equations"\n[model.inputs]\nu = { unit = "m/s^2" }\n[model.states]\n'
        'x = { unit = "m", rate = "v" }\nv = { unit = "m/s", rate = "u - k*x - k3*x^3" }\n'
        '[model.outputs]\ny = { unit = "m", value = "x" }\n[model.parameters]\n'
        'k = { value = 1e12, unit = "1/s^2" }\nk3 = { value = 2.5e29, unit = "1/(m^2*s^2)" }\n',
        encoding="utf-8",
    )
    slopes = rtctl.dynamics(model).matrices([2e-9, 0.0])
    np.testing.assert_allclose(slopes.A, [[0.0, 1.0], [-(1e12 + 3.0 * 2.5e29 * 4e-18), 0.0]], rtol=1e-3)
    np.testing.assert_allclose((slopes.B, slopes.C.T), ([[0.0], [1.0]], [[1.0], [0.0]]), rtol=1e-3)


def test_units_of_equations_are_those_of_their_file() -> None:
    made = rtctl.dynamics(EXAMPLES / "cascaded_tanks.toml")
    assert made.states == {"x1": "cm", "x2": "cm"}
    model = rtctl.read_model(EXAMPLES / "cascaded_tanks.toml")
    values = {name: one.value for name, one in model.parameters.items()}
    found = made.laws.rates(0.0, np.array([4.0, 3.0]), np.array([2.0]))
    assert np.isfinite(found).all()
    assert values
    slopes = made.matrices([4.0, 3.0], {"u": 2.0})
    ahead, behind = (made.laws.rates(0.0, np.array([4.0 + h, 3.0]), np.array([2.0])) for h in (1e-4, -1e-4))
    np.testing.assert_allclose(slopes.A[:, 0], (ahead - behind) / 2e-4, rtol=1e-6, atol=1e-12)


def test_a_nonlinear_system_of_control_steps_as_the_equations_do(tmp_path: Path) -> None:
    made = rtctl.dynamics(EXAMPLES / "oscillator.toml")
    t = np.linspace(0.0, 0.2, 101)
    response = control.input_output_response(
        made.nonlinear_system(),
        t,
        np.ones((1, 101)),
        made.initial,
        solve_ivp_kwargs={"rtol": 1e-9, "atol": 1e-12},
    )
    run = solve_ivp(
        made.right_hand_side({"drive": 1.0}), (0.0, 0.2), made.initial, t_eval=t, rtol=1e-9, atol=1e-12
    )
    np.testing.assert_allclose(response.outputs, run.y[0], atol=1e-7 * np.ptp(run.y[0]))
    assert np.ptp(run.y[0]) > 0.01


def test_a_vo2_on_a_branch_is_a_lag_and_a_slope(tmp_path: Path) -> None:
    from rtctl.models.vo2 import save_model

    save_model(tmp_path / "vo2.toml", small_model())
    model = rtctl.read_model(tmp_path / "vo2.toml")
    slopes = {}
    for branch in ("rising", "falling"):
        system = rtctl.dynamics(model, branch=branch).linearise([6.6**2], {"current": 6.6})
        assert system.poles().real == pytest.approx(-1.0 / TAU_S)
        slopes[branch] = float(control.dcgain(system)[1, 0])  # um for 1 mA
        loop = small_model().deflection_preisach
        path = [6.6 - 1e-5, 6.6 + 1e-5] if branch == "rising" else [9.5, 6.6 + 1e-5, 6.6 - 1e-5]
        y = loop.simulate(np.array(path))
        assert slopes[branch] == pytest.approx((y[-1] - y[-2]) / (path[-1] - path[-2]), rel=1e-3)
    assert abs(slopes["rising"] - slopes["falling"]) > 1.0


def test_what_is_no_differential_equation_is_refused_with_its_name(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"events: .*bounce"):
        rtctl.dynamics(EXAMPLES / "bouncing_ball.toml")
    with pytest.raises(InputError, match=r"actuator\.backlash is no differential equation"):
        rtctl.dynamics(oscillator(tmp_path, "actuator.backlash"))
    made = rtctl.dynamics(oscillator(tmp_path))
    with pytest.raises(InputError, match='no input "driv"; did you mean "drive"'):
        made.right_hand_side({"driv": 1.0})
    with pytest.raises(InputError, match="2 finite numbers"):
        made.linearise([0.0])
    with pytest.raises(InputError, match="branch is of hysteretic models"):
        rtctl.dynamics(oscillator(tmp_path), branch="rising")
