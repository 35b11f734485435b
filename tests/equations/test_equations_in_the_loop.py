"""A user's equations in a loop: acquired, estimated and controlled, in this process and over a wire."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from equation_cases import TANKS, written
from wire_cases import served_process

import rtctl
from plant_sim.equations.controlled import ControlledEquations
from rtctl.border.errors import InputError
from rtctl.cli import main
from rtctl.controllers.pid import PidController, PidGains
from rtctl.controllers.pid_tuning import WorkingPoint, tune_pid
from rtctl.estimators.cubature import CubatureFilter, FilterSettings, _chi_squared_limit
from rtctl.estimators.equations.rest import rest_point, rests_anywhere, state_at_rest, swept_points
from rtctl.interfaces import Estimate, EstimateStatus
from rtctl.loop.live_parameters import Change
from rtctl.plants.equations.control import EquationsSupport, linear_plant
from rtctl.scenario.schema import checked_scenario
from rtctl.session.live.change_rules import ChangeRules

COIL = Path(__file__).parents[2] / "scenarios" / "models" / "equations" / "voice_coil.toml"
STEPS = Path(__file__).parents[2] / "scenarios" / "voice_coil_steps.toml"
SPRING = """
[model]
kind = "equations"
[model.inputs]
force = { unit = "N" }
[model.states]
z = { unit = "mm", rate = "v" }
v = { unit = "mm/s", rate = "(force - k*z - c*v)/m" }
[model.outputs]
strain = { unit = "1", value = "z/span" }
place = { unit = "mm", value = "z" }
[model.parameters]
k = { value = 900.0, unit = "N/m" }
c = { value = 0.6, unit = "N*s/m" }
m = { value = 10.0, unit = "g" }
span = { value = 50.0, unit = "mm" }
[device]
reference = "place"
[device.inputs.force]
low = -2.0
high = 2.0
[device.outputs.strain]
noise = 2e-4
[device.outputs.place]
sensed = false
low = -1.5
high = 1.5
"""


def scenario_of(model: Path, **tables: Any) -> dict[str, Any]:
    return {
        "scenario": {"title": "spring", "plant": "equations", "model": str(model), "period": "2 ms", "duration": "1 s"},
        "limits": {"low": "-2 N", "high": "2 N", "safe": "0 N", "sensed_low": -0.1, "sensed_high": 0.1},
        "reference": {"kind": "steps", "levels": ["0 mm", "1 mm"], "hold": "500 ms"},
        **tables,
    }  # fmt: skip


def test_a_coil_is_positioned_by_its_voltage_and_current_alone(tmp_path: Path) -> None:
    changes = {
        "reference.levels": ["0 mm", "1.5 mm", "-1 mm"],
        "reference.hold": "60 ms",
        "scenario.duration": "180 ms",
    }
    run = rtctl.run(STEPS, settings=changes, out=tmp_path / "run")
    assert run.fault is None
    signals = pq.read_table(tmp_path / "run" / "signals.parquet").to_pydict()
    error = np.abs(np.array(signals["estimate"]) - np.array(signals["x"]))
    assert error.max() < 0.06  # mm of 6, from a current with 0.5 mA of noise
    place = np.array(signals["x"])
    assert abs(place[590] - 1.5) < 0.01
    assert abs(place[-10] + 1.0) < 0.01
    assert place.max() < 1.5 * 1.05  # no overshoot
    assert main(["replay", str(tmp_path / "run"), "--quiet"]) == 0  # to the bit, by the recording alone


def test_over_a_wire_the_loop_is_the_same_to_the_bit(tmp_path: Path) -> None:
    model = written(tmp_path, SPRING)
    own = {"estimator": {"kind": "kalman"}, "driver": {"kind": "inprocess", "device": str(model), "seed": 3}}
    here = rtctl.run(scenario_of(model, **own))
    with served_process(str(model), "modbus-tcp", tmp_path, seed=3) as device:
        assigned = dict(word.split("=", 1) for word in device.settings[1::2])
        driver = {key.removeprefix("driver."): value for key, value in assigned.items()}
        there = rtctl.run(scenario_of(model, estimator={"kind": "kalman"}, driver=driver))
    for name in ("estimate", "force", "place"):
        assert np.array_equal(here.signals[name], there.signals[name]), name


def test_acquired_data_have_the_roles_of_the_model(tmp_path: Path) -> None:
    model = written(tmp_path, SPRING)
    excitation = {"kind": "random_multisine", "use": "fit", "duration": "2 s", "frequency_low": "1 Hz",
                  "frequency_high": "100 Hz", "amplitude": "30 %", "seed": 1}  # fmt: skip
    tables = scenario_of(model, excitation=[excitation])
    del tables["reference"], tables["scenario"]["duration"]
    data = rtctl.acquire(tables, tmp_path / "data")
    assert dict(data.holds) == {"force": "zero"}
    assert dict(data.units) == {"force": "N", "strain": "1", "place": "mm"}
    start = written(
        tmp_path,
        SPRING.replace("900.0", "800.0").replace(
            "span = { value = 50.0", "span = { fixed = true, value = 50.0"
        ),
        "start.toml",
    )
    fit = rtctl.identify(data, model=start)
    assert fit.parameters["k"].value / fit.parameters["m"].value == pytest.approx(90.0, rel=0.01)


def test_of_linear_equations_the_filter_is_kalman_s(tmp_path: Path) -> None:
    """Oracle: the textbook's recursion with the matrix exponential of the equations."""
    from scipy.linalg import expm

    model = ControlledEquations(written(tmp_path, SPRING))
    drift, noise, start = np.array([1e-9, 1e-4]), np.array([2e-4]), np.array([1e-4, 1e-2])
    settings = FilterSettings(start=start, drift=drift, noise=noise, step_s=1e-5)
    found = CubatureFilter(model, settings)
    h = 2e-3
    a, b = np.array([[0.0, 1.0], [-9e4, -60.0]]), np.array([0.0, 100.0])  # m, m/s, N
    whole = np.zeros((3, 3))
    whole[:2, :2], whole[:2, 2] = a, b
    moved = expm(whole * h)
    phi, gamma, c = moved[:2, :2], moved[:2, 2], np.array([[20.0, 0.0]])  # strain over m
    x, p = np.zeros(2), np.diag(start**2)
    rng = np.random.default_rng(0)
    for k in range(40):
        force, z = float(rng.standard_normal()), 4e-3 * rng.standard_normal(1)
        if k:
            x, p = phi @ x + gamma * force, phi @ p @ phi.T + np.diag(drift * h)
        s = c @ p @ c.T + noise**2
        s = np.maximum(s, (z - c @ x) ** 2 / _chi_squared_limit(1, settings.least_probability))
        gain = p @ c.T / s
        x, p = x + gain @ (z - c @ x), p - gain @ c @ p
        given = found.step([force], z, h) if k else found.start([0.0], z)
        assert given.value == pytest.approx(1e3 * x[0], rel=1e-6, abs=1e-9)
        assert given.confidence == pytest.approx(1e3 * np.sqrt(p[0, 0]), rel=1e-6)


def test_a_reading_that_is_none_moves_nothing_and_says_so(tmp_path: Path) -> None:
    model = ControlledEquations(written(tmp_path, SPRING))
    settings = FilterSettings(
        start=np.full(2, 1e-3), drift=np.full(2, 1e-9), noise=np.array([2e-4]), step_s=1e-4
    )
    found = CubatureFilter(model, settings)
    found.start([0.0], [0.0])
    lost = found.step([0.0], [float("nan")], 1e-3)
    assert lost.status == 8
    assert abs(lost.value) < 1e-6
    assert found.step([0.0], [0.09], 1e-3).status == 16  # 4.5 mm from where the equations have it


@pytest.mark.parametrize("wrong", [1, 5])
def test_wrong_readings_are_told_and_hardly_believed(wrong: int, tmp_path: Path) -> None:
    """One or five of thirty, somewhere within the sensor's range: the mean error stays below twice that without."""
    model = ControlledEquations(written(tmp_path, SPRING))
    settings = FilterSettings(
        start=np.array([1e-4, 1e-2]), drift=np.array([1e-9, 1e-4]), noise=np.array([2e-4]), step_s=1e-4
    )
    errors = {}
    for spoilt in (False, True):
        found, device = CubatureFilter(model, settings), CubatureFilter(model, settings)
        found.start([0.0], [0.0])
        device.start([0.0], [0.0])
        rng, total = np.random.default_rng(7), []
        for k in range(300):
            force = float(np.sin(0.1 * k))
            true = device.step([force], [float("nan")], 2e-3).value
            reading = 20e-3 * true + 2e-4 * rng.standard_normal()
            struck = spoilt and k % 30 >= 30 - wrong
            given = found.step([force], [0.3 if struck else reading], 2e-3)
            assert (given.status == EstimateStatus.DISAGREES) == struck
            total.append(abs(given.value - true))
        errors[spoilt] = np.mean(total)
    assert errors[True] < 2.0 * errors[False]


def test_a_point_of_rest_solves_the_equations(tmp_path: Path) -> None:
    model = ControlledEquations(COIL)
    at = rest_point(model, (0.0,), 1.5, 12.0)
    assert at.holds
    x = 1.5
    bl, k = 6.0 * (1.0 - 0.02 * x - 0.012 * x * x), 1500.0 * (1.0 + 0.03 * x + 0.015 * x * x)
    slope = -0.06  # N/A^2: the reluctance force
    current = np.roots([0.5 * slope, bl, -1e-3 * k * x])
    assert at.level == pytest.approx(6.0 * current[np.abs(current).argmin()], rel=1e-6)
    assert model.controlled(state_at_rest(model, [at.level])[None], [at.level])[0] == pytest.approx(
        x, rel=1e-6
    )
    assert not rest_point(
        ControlledEquations(written(tmp_path, TANKS)), (0.0,), -2.0, 5.0
    ).holds  # no level below 0


def test_with_hysteresis_the_working_points_are_those_that_a_slow_motion_reaches() -> None:
    """Oracle of the stack: its slope is that of Bouc and Wen's law on the way up and on the way down."""
    model = ControlledEquations(COIL.with_name("piezo_stack.toml"))
    assert rests_anywhere(model, rest_point(model, (0.0,), 8.0, 120.0), (0.0,))
    assert not rests_anywhere(
        ControlledEquations(COIL), rest_point(ControlledEquations(COIL), (0.0,), 1.0, 12.0), (0.0,)
    )
    found = swept_points(model, (0.0,), (0.0, 120.0), [8.0])
    assert [one.side for one in found] == [1, -1]
    for point in found:
        volt, h = point.x[:2]
        assert volt == pytest.approx(point.level)
        way = point.side * (0.25 - 0.04 * (point.side * h + 0.2 * abs(h)))  # dh/dV on this way
        plant = linear_plant(model, point, (0.0,), 120.0)
        assert plant.b[1] / plant.b[0] == pytest.approx(point.side * way, rel=1e-3)
    assert found[0].level > found[1].level + 5.0  # V: the same place takes more on the way up


def test_a_tuned_pid_keeps_its_bounds() -> None:
    """Oracle: the closed loop as python-control's system on a grid of its own."""
    import control

    plant = WorkingPoint(
        a=np.array([[0.0, 1.0], [-400.0, -4.0]]), b=np.array([0.0, 800.0]), c=np.array([1.0, 0.0])
    )
    h, found = 2e-3, None
    found = tune_pid(
        [plant], period_s=h, delay=1, maximum_sensitivity=1.5, setpoint_weight=0.0, units=("V", "mm")
    )
    gains, z = found.gains, control.tf([1.0, 0.0], [1.0], h)
    sampled = control.sample_system(
        control.ss(plant.a, plant.b[:, None], plant.c[None], 0.0), h, method="zoh"
    )
    law = (
        gains.kp
        + gains.ki * h * z / (z - 1)
        + gains.kd * (z - 1) / ((gains.filter_s + h) * z - gains.filter_s)
    )
    loop = control.tf(sampled) * law / z
    assert max(abs(control.feedback(loop, 1).poles())) < 1.0
    w = np.geomspace(0.05, np.pi / h, 3000)
    sensitivity = 1.0 / (1.0 + loop(np.exp(1j * w * h)))
    assert abs(sensitivity).max() == pytest.approx(found.maximum_sensitivity, rel=0.01)
    assert found.maximum_sensitivity < 1.5
    assert found.gains.ki > 5.0  # with a gain of 2 and 3.2 Hz: an integral alone reaches less


def test_a_pid_starts_without_a_bump_and_winds_nothing_up() -> None:
    pid = PidController(PidGains(kp=2.0, ki=10.0, kd=0.1), unit="V", setpoint_weight=0.3, others=(4.0,))
    here = Estimate(1.0, 0.0, 0.0, 0)
    pid.start([0.7, 4.0], 5.0, here)
    first = pid.step(5.0, 5.0, here, 0.01)
    assert first.levels == pytest.approx((0.7 + 10.0 * 4.0 * 0.01, 4.0))
    for _ in range(50):
        asked = pid.step(5.0, 5.0, here, 0.01).levels[0]
        pid.applied([min(asked, 1.0), 4.0])
    assert pid.step(0.5, 0.5, here, 0.01).levels[0] < 1.0  # at once, however long it was limited
    before = sum(pid.step(1.0, 1.0, here, 0.01).terms)
    pid.change("controller.kp", 4.0)
    assert sum(pid.step(1.0, 1.0, here, 0.01).terms) == pytest.approx(before)
    with pytest.raises(ValueError, match="of one sign"):
        pid.change("controller.ki", -1.0)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("low = -1.5\nhigh = 1.5\n", "", "give low and high"),
        ("[device.outputs.place]\nsensed = false", "[device.outputs.place]\nsense = false", "sense"),
        ('reference = "place"', 'reference = "strain"', "only device.reference may be hidden"),
        ("low = -1.5", "low = 1.5", "low = 1.5 must be below high = 1.5"),
        ('force = { unit = "N" }', 'safe = { unit = "N" }', "rename it in the model"),
    ],
)
def test_what_a_loop_cannot_use_is_said(tmp_path: Path, old: str, new: str, said: str) -> None:
    text = SPRING.replace(old, new)
    if "safe" in new:
        text = text.replace("(force -", "(safe -").replace("device.inputs.force", "device.inputs.safe")
    with pytest.raises(InputError, match=said):
        rtctl.run(scenario_of(written(tmp_path, text), estimator={"kind": "kalman"}))


def test_gains_by_which_the_loop_would_be_unstable_are_refused_before_and_while_it_runs(
    tmp_path: Path,
) -> None:
    model = ControlledEquations(written(tmp_path, SPRING))
    tables = scenario_of(tmp_path / "model.toml", estimator={"kind": "kalman"})
    scenario = checked_scenario(tables, "scenario")
    made = EquationsSupport().control(scenario, model, 0)
    assert isinstance(made.controller, PidController)
    rules = ChangeRules(scenario, model, made.controller, EquationsSupport().output_range(scenario, model))
    gains = made.controller.gains
    slower = rules.judge("controller.ki", 0.9 * gains.ki)
    assert "gain margin" in slower
    assert rules.judge("controller.kd", 30.0 * gains.kd) != slower  # with the derivative that the loop has
    for name, value in (("ki", 100.0 * gains.ki), ("kp", 1e3 * gains.kp)):
        with pytest.raises(InputError, match="would be unstable"):
            rules.judge(f"controller.{name}", value)
    assert rules.current["controller.ki"] == pytest.approx(0.9 * gains.ki)  # what was refused was not taken
    with pytest.raises(
        InputError, match=r"no such parameter; it has controller\.kd, controller\.ki, controller\.kp"
    ):
        rules.judge("controller.kq", 1.0)
    with pytest.raises(InputError, match="would be unstable"):  # a name that is not known left gains unjudged
        rules.judge("controller.ki", 100.0 * gains.ki)
    rules.judge("controller.kp", 0.9 * gains.kp)
    rules.take_back(Change("controller.kp", 0.9 * gains.kp))
    assert rules.current["controller.kp"] == gains.kp
    by_hand = {"kind": "pid", "kp": "0 N/mm", "ki": f"{100.0 * gains.ki} N/mm/s"}
    with pytest.raises(
        InputError, match=r"the loop would be unstable where the device rests; give less gain"
    ):
        rtctl.run(scenario_of(tmp_path / "model.toml", controller=by_hand))


def test_mechanisms_beside_the_equations_are_not_passed_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of an extended model from a diagnosis the loop takes the equations and says so; a device is not made of it."""
    delay = (
        '[[model.mechanisms]]\nid = "input.force.delay"\n'
        '[model.mechanisms.parameters]\ndelay = { value = 0.004, unit = "s" }\n'
    )
    own = written(tmp_path, SPRING)
    extended = written(tmp_path, SPRING.replace("[device]\n", delay + "[device]\n"), "extended.toml")
    assert rtctl.read_model(extended) is not None
    tables = scenario_of(own, estimator={"kind": "kalman"}, driver={"kind": "inprocess", "device": str(own)})
    rtctl.run(
        {**tables, "scenario": {**tables["scenario"], "duration": "20 ms"}}, model=extended, progress=True
    )
    assert "does not change the loop: input.force.delay" in "".join(capsys.readouterr())
    with pytest.raises(InputError, match=r"made of equations alone, and input.force.delay would be missing"):
        rtctl.run(scenario_of(extended))


def test_a_scenario_names_the_model_whose_channels_it_has(tmp_path: Path) -> None:
    tables = scenario_of(written(tmp_path, SPRING))
    del tables["scenario"]["model"]
    with pytest.raises(InputError, match=r'key "scenario.model" is missing.*or give \[scenario.channels\]'):
        rtctl.run(tables)
    with pytest.raises(InputError, match="there is no file"):
        rtctl.run(scenario_of(tmp_path / "other.toml"))
    with pytest.raises(InputError, match=r'"controller.ki": unit "V/mm/s" is not compatible with N/mm/s'):
        rtctl.run(
            scenario_of(
                written(tmp_path, SPRING), controller={"kind": "pid", "kp": "1 V/mm", "ki": "1 V/mm/s"}
            )
        )
