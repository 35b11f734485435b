"""A loop over several outputs: decoupled at rest, each within its limits, each scored."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from equation_cases import written

import rtctl
from plant_sim.equations.controlled import ControlledEquations
from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.cli import main
from rtctl.controllers.pid import PidController, PidGains
from rtctl.controllers.pid_tuning import WorkingPoint, margins_of_gains
from rtctl.controllers.several.decoupled_pid import DecoupledPid
from rtctl.controllers.several.decoupling import Decoupler, decoupler
from rtctl.controllers.several.margins import SampledPlant, SeveralPlant
from rtctl.estimators.several_outputs import SeveralEstimates
from rtctl.interfaces import Estimate
from rtctl.plants.equations.several import SeveralTuning, decoupled_control
from rtctl.scenario.schema import checked_scenario, load_scenario

MIRROR = Path(__file__).resolve().parents[2] / "scenarios" / "vo2_mirror_steps.toml"
HEATERS = """
[model]
kind = "equations"
[model.inputs]
p = { unit = "W" }
q = { unit = "W" }
[model.states]
a = { unit = "K", rate = "(p - loss*a - exchange*(a - b))/capacity" }
b = { unit = "K", rate = "(q - loss*b - exchange*(b - a))/capacity" }
[model.outputs]
warm = { unit = "K", value = "a" }
other = { unit = "K", value = "b" }
[model.parameters]
loss = { value = 1.0, unit = "W/K" }
exchange = { value = 2.0, unit = "W/K" }
capacity = { value = 0.5, unit = "J/K" }
[device]
outputs.warm = { low = 0, high = 10 }
outputs.other = { low = 0, high = 10 }
"""


def heaters(model: Path, **tables: Any) -> dict[str, Any]:
    return {
        "scenario": {"title": "h", "plant": "equations", "model": str(model), "period": "10 ms", "duration": "8 s"},
        "limits": {"low": "0 W", "high": "20 W", "q": {"low": "0 W", "high": "20 W"}},
        "reference": {"kind": "steps", "levels": ["4 K", "6 K"], "hold": "4 s"},
        "references": {"other": {"kind": "steps", "levels": ["5 K"], "hold": "8 s"}},
        **tables,
    }  # fmt: skip


def test_two_heaters_that_warm_each_other_hold_both_temperatures(tmp_path: Path) -> None:
    run = rtctl.run(heaters(written(tmp_path, HEATERS)))
    assert run.fault is None
    warm, other = (np.asarray(run.signals[name]) for name in ("warm", "other"))
    assert abs(warm[395] - 4.0) < 0.01
    assert abs(warm[-1] - 6.0) < 0.01
    assert np.abs(other[390:] - 5.0).max() < 0.3  # the step of the neighbour by 2 K would move it by 1.3 K
    assert abs(other[-1] - 5.0) < 1e-3
    assert set(run.summary["outputs"]) == {"warm", "other"}
    assert run.summary["outputs"]["warm"]["tracking"] == run.summary["tracking"]
    np.testing.assert_allclose(run.signals["estimate_other"], other, atol=1e-9)
    assert (np.asarray(run.signals["setpoint_other"]) == 5.0).all()


def test_a_mirror_is_tipped_tilted_and_raised_from_four_resistances(tmp_path: Path) -> None:
    run = rtctl.run(MIRROR, settings={"scenario.duration": "0.3 s"})
    assert run.summary["verdict"] == "pass"
    for name, span in (("tip", 20.0), ("tilt", 20.0), ("height", 30.0)):
        figures = run.summary["outputs"][name]
        assert figures["self_sensing"]["mean_abs_percent"] < 0.3, name
        wanted = np.asarray(run.signals["setpoint" if name == "tip" else f"setpoint_{name}"])
        error = np.abs(np.asarray(run.signals[name]) - wanted)
        assert error[-100:].max() < 0.05 * span, name
    time_s = 5e-4 * np.asarray(run.signals["index"])
    wanted = 30.0 + 3.0 * np.sin(2.0 * np.pi * 4.0 * time_s)
    np.testing.assert_allclose(run.signals["setpoint_height"], wanted, atol=1e-9)
    worst = max(one["tracking"]["mean_abs_percent"] for one in run.summary["outputs"].values())
    assert run.summary["checks"][0]["measured"] == worst > run.summary["tracking"]["mean_abs_percent"]


def test_the_command_line_prints_every_output(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tables = heaters(written(tmp_path, HEATERS))
    path = written(tmp_path, tomli_w.dumps(tables), "scenario.toml")
    assert main(["run", str(path), "--out", str(tmp_path / "out"), "--set", "scenario.duration=0.5 s"]) == 0
    said = capsys.readouterr().out
    for row in ("warm tracking", "warm self-sensing", "other tracking", "other self-sensing"):
        assert row in said
    assert "PIDs of warm, other behind a static decoupler (condition number 5)" in said


def test_a_decoupler_moves_each_output_alone() -> None:
    gains = np.array([[2.0, 1.0, 0.5], [0.3, 1.0, -1.0]])
    made = decoupler(gains, np.array([1.0, 5.0, 2.0]), np.array([3.0, 0.1]), "abc", "xy")
    np.testing.assert_allclose(made.gains @ made.inverse, np.eye(2), atol=1e-12)
    least = np.linalg.pinv(gains * [1.0, 5.0, 2.0])  # of all commands that do it, over their ranges
    np.testing.assert_allclose(made.inverse, least * [[1.0], [5.0], [2.0]], atol=1e-12)


@pytest.mark.parametrize(
    ("gains", "said"),
    [
        (
            [[1.0, 1.0], [1.0, 1.001]],
            r"condition number 4e\+03, at most 100; the combination .*0.71 x -0.71 y",
        ),
        ([[1.0], [1.0]], r"1 commands \(a\) cannot hold 2 outputs \(x, y\); leave out a reference"),
        ([[1.0, np.nan], [1.0, 1.0]], "not finite"),
    ],
)
def test_gains_that_cannot_be_inverted_are_said(gains: list[list[float]], said: str) -> None:
    matrix = np.array(gains)
    with pytest.raises(ValueError, match=said):
        decoupler(matrix, np.ones(matrix.shape[1]), np.ones(2), "ab"[: matrix.shape[1]], "xy")


def of(value: float, *further: float) -> SeveralEstimates:
    made = SeveralEstimates(value, np.nan, 0.0, 0)
    made.further = further
    return made


def test_one_output_of_gain_one_is_a_plain_pid() -> None:
    """Bumpless start, terms, limits: number for number."""
    gains, one = PidGains(kp=0.8, ki=3.0, kd=0.02), np.ones((1, 1))
    alone = PidController(gains, unit="V", setpoint_weight=0.3)
    several = DecoupledPid(
        gains, Decoupler(gains=one, inverse=one, condition=1.0), np.zeros(1), [("y", "V")], np.empty((0, 50)),
        period_s=0.01, setpoint_weight=0.3,
    )  # fmt: skip
    alone.start((0.4,), 1.0, Estimate(0.1, np.nan, 0.0, 0))
    several.start((0.4,), 1.0, of(0.1))
    for k in range(50):
        value = 0.1 + 0.02 * k
        a = alone.step(1.0, 1.0, Estimate(value, np.nan, 0.0, 0), 0.01)
        b = several.step(1.0, 1.0, of(value), 0.01)
        np.testing.assert_allclose(b.levels, a.levels, rtol=1e-12)
        np.testing.assert_allclose(b.terms, a.terms, rtol=1e-12)
        passed = (min(a.levels[0], 0.6),)
        alone.applied(passed)
        several.applied(passed)


def test_a_limit_does_not_wind_up_the_outputs_that_share_it(tmp_path: Path) -> None:
    """For a while both ask for more than there is; once they ask for less, they follow at once."""
    tables = heaters(written(tmp_path, HEATERS))
    tables["limits"]["q"]["high"] = "8 W"
    tables["reference"]["levels"], tables["references"]["other"] = ["9 K", "3 K"], {
        "kind": "steps", "levels": ["9 K", "3 K"], "hold": "4 s",
    }  # fmt: skip
    run = rtctl.run(tables)
    assert np.asarray(run.signals["q"])[300] == 8.0
    for name in ("warm", "other"):
        course = np.asarray(run.signals[name])
        assert np.abs(course[550:] - 3.0).max() < 0.05, name


def test_what_a_loop_of_several_outputs_cannot_have_is_said(tmp_path: Path) -> None:
    model = written(tmp_path, HEATERS)
    steps = {"kind": "steps", "levels": ["5 K"], "hold": "8 s"}
    for changes, said in (
        ({"references": {"othr": steps}}, 'did you mean "other"'),
        ({"references": {"other": {**steps, "levels": ["5 m"]}}}, 'unit "m" is not compatible with K'),
        (
            {"references": {"other": {**steps, "levels": ["50 K"]}}},
            r"\[references.other\] asks for 50 to 50 K",
        ),
        ({"references": {"warm": steps}}, "has the \\[reference\\] already"),
        ({"controller": {"kp": "1 W/K", "ki": "1 W/K/s"}}, "kp, ki and kd are for a loop of one output"),
        ({"safety": {"rearm": 1}}, "safety.rearm"),
    ):
        with pytest.raises(InputError, match=said):
            rtctl.run(heaters(model, **changes))
    alike = written(tmp_path, HEATERS.replace('value = "b"', 'value = "a + 0.01*b"'), "alike.toml")
    with pytest.raises(InputError, match=r"nearly singular: condition number .* leave out one of these"):
        rtctl.run(heaters(alike))


def test_the_loops_together_are_as_insensitive_as_each_may_be() -> None:
    scenario, _ = load_scenario(MIRROR, [])
    tuning = decoupled_control(
        scenario, ControlledEquations(MIRROR.parent / "models/equations/vo2_mirror.toml"), 0
    ).tuning
    assert isinstance(tuning, SeveralTuning)
    assert 1.0 < tuning.maximum_sensitivity <= 1.6
    assert "1 more commands than outputs" in tuning.describe()


def test_loops_of_which_one_disturbs_the_other_keep_the_bound_together(tmp_path: Path) -> None:
    """The eigenvalues of such a plant are those of two that do not meet: they alone would allow far more gain."""
    one_way = HEATERS.replace(" - exchange*(a - b)", "").replace("- exchange*(b - a)", "+ 2*exchange*a")
    path = written(tmp_path, one_way)
    scenario = checked_scenario(heaters(path), "scenario")
    tuning = decoupled_control(scenario, ControlledEquations(path), 0).tuning
    assert isinstance(tuning, SeveralTuning)
    assert 1.3 < tuning.maximum_sensitivity <= 1.6
    assert tuning.gains.ki < 20.0


def test_sensitivities_of_loops_that_do_not_meet_are_those_of_one() -> None:
    unit, gains = np.eye(2), PidGains(kp=0.5, ki=0.5)

    def plant(a: FloatArray, b: FloatArray, period_s: float, delay: int) -> SampledPlant:
        n = len(a)
        made = SeveralPlant(a=a, b=b, c=np.eye(n), d=np.zeros((n, n)))
        return SampledPlant(made, np.ones(n), period_s, delay)

    alone = WorkingPoint(a=-unit[:1, :1], b=np.ones(1), c=np.ones(1))
    expected = margins_of_gains(gains, [alone], period_s=0.1, delay=2, units=("1", "1")).maximum_sensitivity
    assert plant(-unit, unit, 0.1, 2).largest_sensitivity(gains) == pytest.approx(expected)
    crossed = np.array([[-1.0, -3.0], [3.0, -1.0]])
    assert plant(crossed, 20.0 * unit, 0.5, 3).largest_sensitivity(gains) == np.inf
