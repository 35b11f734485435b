"""Events: states that are set anew where an expression passes zero, against SciPy and against the times of bounces."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from equation_cases import simulation_of, written
from scipy.integrate import solve_ivp

from plant_sim.equations.compiled.kernels import march
from plant_sim.equations.integration.steps import Plan
from plant_sim.equations.model import equations_simulation
from plant_sim.equations.plant import load_plant
from plant_sim.equations.reading import read_equations, system_of
from plant_sim.equations.simulation import EquationsSimulation
from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.border.model_file import Value
from rtctl.border.simulation import Stimulus

MODELS = Path(__file__).resolve().parents[2] / "scenarios" / "models" / "equations"
BALL = """
[model]
kind = "equations"
[model.inputs]
a = { unit = "m/s^2" }
[model.states]
height = { unit = "m", rate = "speed", initial = 1.0 }
speed = { unit = "m/s", rate = "-gravity - a - drag*speed*abs(speed)" }
bounces = { unit = "1", rate = 0 }
[model.outputs]
y = { unit = "mm", value = "height" }
[model.parameters]
gravity = { value = 9.81, unit = "m/s^2" }
restitution = { value = 0.8, unit = "1" }
drag = { value = 0.0, unit = "1/m" }
[model.events.bounce]
when = "height"
direction = "falling"
set = { speed = "-restitution*speed", bounces = "bounces + 1" }
"""
GRAVITY = 9.81


def flight(times: FloatArray, restitution: float) -> FloatArray:
    """Height [m] of a ball that falls from 1 m, by its parabolas."""
    landed = np.sqrt(2.0 / GRAVITY)
    found = 1.0 - 0.5 * GRAVITY * times**2
    speed = restitution * GRAVITY * landed
    while landed < times[-1]:
        since = times - landed
        found = np.where(since > 0.0, speed * since - 0.5 * GRAVITY * since**2, found)
        landed, speed = landed + 2.0 * speed / GRAVITY, restitution * speed
    return found


def run(
    simulation: EquationsSimulation, inputs: Mapping[str, FloatArray], period_s: float
) -> dict[str, FloatArray]:
    """Outputs and states (samples,) of one record."""
    stimulus = Stimulus(inputs=inputs, holds=dict.fromkeys(inputs, "zero"), period_s=period_s)
    made = simulation.predict(stimulus, np.array([one.value for one in simulation.parameters]))
    return {name: course[0] for name, course in made.outputs.items()}


def by_scipy(
    rates: Callable[[float, FloatArray, float], list[float]],
    events: list[tuple[Callable[[FloatArray], float], int, Callable[[FloatArray], list[float]]]],
    start: list[float], samples: FloatArray, period_s: float,
) -> FloatArray:  # fmt: skip
    """States (samples, states): each event ends an integration, and the next one begins with the states set anew."""

    def watched(event: Any) -> Any:
        def passes(t: float, x: FloatArray) -> float:
            return event[0](x)

        passes.terminal, passes.direction = True, event[1]
        return passes

    x, found = np.array(start), [np.array(start)]
    for k, level in enumerate(samples[:-1]):
        t, end = k * period_s, (k + 1) * period_s
        while t < end:
            made = solve_ivp(
                lambda t, y, level=level: rates(t, y, level), (t, end), x, method="DOP853", rtol=1e-11,
                atol=1e-12, events=[watched(one) for one in events],
            )  # fmt: skip
            t, x = float(made.t[-1]), made.y[:, -1]
            for event, times in zip(events, made.t_events, strict=True):
                if len(times):
                    x = np.array(event[2](x))
        found.append(x)
    return np.array(found)


@pytest.mark.parametrize("implicit", [False, True])
@pytest.mark.parametrize("period_s", [0.4, 0.02])
def test_a_ball_bounces_at_the_times_of_its_parabolas(
    tmp_path: Path, implicit: bool, period_s: float
) -> None:
    """Long samples hold several bounces, and the ball's rates have no time constant that would ask for short steps."""
    system = system_of(read_equations(written(tmp_path, BALL)), "ball")
    samples = int(3.6 / period_s)
    x = march(
        system, np.array([[1.0], [0.0], [0.0]]), np.zeros((3, samples, 1)), period_s, Plan(1, implicit),
        np.array([[GRAVITY], [0.8], [0.0]]),
    )  # fmt: skip
    expected = flight(period_s * np.arange(samples + 1), 0.8)
    assert np.abs(x[:, 0, 0] - expected).max() < 1e-11
    shares_flown = (3.6 / np.sqrt(2.0 / GRAVITY) - 1.0) / 8.0  # of all flights after the first fall
    assert x[-1, 2, 0] == 1 + np.floor(np.log(1.0 - shares_flown) / np.log(0.8))


def test_lanes_bounce_each_at_their_own_times(tmp_path: Path) -> None:
    simulation = simulation_of(tmp_path, BALL, {"a": "m/s^2", "y": "m"})
    stimulus = Stimulus(inputs={"a": np.zeros(80)}, holds={"a": "zero"}, period_s=0.02)
    own = np.array([one.value for one in simulation.parameters])
    shares = (0.6, 0.7, 0.8, 0.9)
    heights = simulation.predict(stimulus, np.array([own * [1.0, one / 0.8, 1.0] for one in shares]))
    for lane, restitution in enumerate(shares):
        expected = flight(0.02 * np.arange(80), restitution)
        assert np.abs(heights.outputs["y"][lane] - expected).max() < 1e-11


def test_a_ball_with_drag_on_a_shaken_plate_follows_scipy(tmp_path: Path) -> None:
    simulation = simulation_of(
        tmp_path, BALL.replace("value = 0.0,", "value = 0.3,"), {"a": "m/s^2", "y": "m"}
    )
    a = 4.0 * np.sin(np.arange(120) / 5.0)
    found = run(simulation, {"a": a}, 0.02)

    def rates(t: float, x: FloatArray, a: float) -> list[float]:
        return [x[1], -GRAVITY - a - 0.3 * x[1] * abs(x[1]), 0.0]

    bounce = (lambda x: x[0], -1, lambda x: [x[0], -0.8 * x[1], x[2] + 1.0])
    expected = by_scipy(rates, [bounce], [1.0, 0.0, 0.0], a, 0.02)
    assert expected[-1, 2] > 3.0
    assert np.abs(found["height"] - expected[:, 0]).max() < 2e-6
    np.testing.assert_array_equal(found["bounces"], expected[:, 2])


def test_the_shipped_thermostat_follows_scipy(tmp_path: Path) -> None:
    path = MODELS / "thermostat.toml"
    simulation = simulation_of(tmp_path, path.read_text(), {"outdoor": "K", "temperature": "K"})
    outdoor = 278.0 + 5.0 * np.sin(np.arange(200) / 20.0)
    found = run(simulation, {"outdoor": outdoor}, 120.0)

    def rates(t: float, x: FloatArray, outdoor: float) -> list[float]:
        return [(x[1] * 2000.0 - 60.0 * (x[0] - outdoor)) / 4e5, 0.0]

    off = (lambda x: x[0] - 294.0, 1, lambda x: [x[0], 0.0])
    on = (lambda x: x[0] - 293.0, -1, lambda x: [x[0], 1.0])
    expected = by_scipy(rates, [off, on], [292.0, 1.0], outdoor, 120.0)
    assert np.abs(np.diff(expected[:, 1])).sum() > 10.0
    assert np.abs(found["temperature"] - expected[:, 0]).max() < 1e-7
    np.testing.assert_array_equal(found["heating"], expected[:, 1])


def test_a_stiff_model_switches_as_the_one_without_its_fast_part(tmp_path: Path, monkeypatch) -> None:
    text = (MODELS / "thermostat.toml").read_text()
    outdoor = {"outdoor": 278.0 + 5.0 * np.sin(np.arange(60) / 20.0)}
    units = {"outdoor": "K", "temperature": "K"}
    plain = run(simulation_of(tmp_path, text, units), outdoor, 120.0)
    stiff = text.replace(
        "[model.outputs]",
        'sensor = { unit = "K", rate = "(room - sensor)/lag", initial = 292 }\n[model.outputs]',
    )
    stiff = stiff.replace("room - high", "sensor - high").replace("room - low", "sensor - low")
    stiff = stiff.replace("[model.parameters]", '[model.parameters]\nlag = { value = 1e-3, unit = "s" }')
    monkeypatch.setattr("plant_sim.equations.compiled.kernels._integrator", refused)
    found = run(simulation_of(tmp_path, stiff, units), outdoor, 120.0)
    assert np.ptp(plain["temperature"]) > 1.0
    assert np.abs(found["temperature"] - plain["temperature"]).max() < 1e-4
    np.testing.assert_array_equal(found["heating"], plain["heating"])


def refused(*arguments: object) -> None:
    raise AssertionError("explicit steps of a stiff model")


def test_the_shipped_ball_comes_to_rest_and_is_lifted_again(tmp_path: Path) -> None:
    path = MODELS / "bouncing_ball.toml"
    simulation = simulation_of(tmp_path, path.read_text(), {"acceleration": "m/s^2", "gap": "mm"})
    a = np.where(np.arange(200) < 150, 0.0, -12.0)
    found = run(simulation, {"acceleration": a}, 0.01)
    assert found["gap"].min() > -1e-9
    assert (found["gap"][110:151] == 0.0).all()
    since = 0.01 * np.arange(50)
    np.testing.assert_allclose(found["gap"][150:], 0.5 * (12.0 - 9.81) * since**2 * 1e3, atol=1e-9)


SWITCH = """
[model]
kind = "equations"
[model.inputs]
u = { unit = "V" }
[model.states]
x = { unit = "1", rate = "(gate - x)/tau" }
gate = { unit = "1", rate = 0 }
count = { unit = "1", rate = 0 }
[model.outputs]
y = { unit = "1", value = "x" }
[model.parameters]
tau = { value = 0.5, unit = "s" }
level = { value = 1.0, unit = "V" }
[model.events.open]
when = "u - level"
direction = "rising"
set = { gate = 1 }
[model.events.close]
when = "level - u"
direction = "rising"
set = { gate = 0 }
[model.events.any]
when = "gate - 0.5"
set = { count = "count + 1" }
"""


def test_what_jumps_past_zero_is_an_event_and_events_cause_others(tmp_path: Path) -> None:
    u = np.repeat([0.0, 2.0, 2.5, -3.0, 5.0], 10)
    found = run(simulation_of(tmp_path, SWITCH, {"u": "V", "y": "1"}), {"u": u}, 0.1)
    gate = np.append(0.0, (u > 1.0)[:-1])  # a sample shows what is just before its input jumps
    np.testing.assert_array_equal(found["gate"], gate)
    np.testing.assert_array_equal(found["count"], np.cumsum(np.abs(np.diff(gate, prepend=0.0))))
    x = 0.0
    for k in range(10, 50):
        assert found["x"][k] == pytest.approx(x, abs=1e-7)
        x = (u[k] > 1.0) + (x - (u[k] > 1.0)) * np.exp(-0.1 / 0.5)


def test_a_device_has_the_events_of_its_simulation(tmp_path: Path) -> None:
    path = written(tmp_path, SWITCH)
    plant = load_plant(path)
    u = np.repeat([0.0, 2.0, 2.5, -3.0, 5.0], 10)
    read = [plant.step((level,), 0.1)[0][0] for level in u]
    expected = run(simulation_of(tmp_path, SWITCH, {"u": "V", "y": "1"}), {"u": np.append(u, 0.0)}, 0.1)
    np.testing.assert_allclose(read, expected["y"][1:], atol=1e-9)
    assert max(read) > 0.8


def test_a_passage_counts_in_its_direction_alone(tmp_path: Path) -> None:
    """A sine passes 0.5 once on the way up and once on the way down, and is not turned back by what it counts."""
    text = """
[model]
kind = "equations"
[model.states]
x = {{ unit = "1", rate = "w*v" }}
v = {{ unit = "1", rate = "-w*x", initial = 1 }}
n = {{ unit = "1", rate = 0 }}
[model.outputs]
y = {{ unit = "1", value = "n" }}
[model.parameters]
w = {{ value = 6.2831853, unit = "1/s" }}
[model.events.pass]
when = "x - 0.5"
direction = "{}"
set = {{ n = "n + 1" }}
"""
    after_a_tenth, after_a_half = {"rising": 1.0, "falling": 0.0, "either": 1.0}, 2.0
    for direction, first in after_a_tenth.items():
        simulation = simulation_of(tmp_path, text.format(direction), {"y": "1"})
        stimulus = Stimulus(inputs={}, holds={}, period_s=0.1, count=31)
        found = simulation.predict(stimulus, np.array([2.0 * np.pi])).outputs["n"][0]
        assert found[1] == first
        assert found[5] == (after_a_half if direction == "either" else 1.0)
        assert found[30] == (6.0 if direction == "either" else 3.0)


def test_events_without_end_are_named_with_their_time(tmp_path: Path) -> None:
    simulation = simulation_of(tmp_path, BALL, {"a": "m/s^2", "y": "m"})
    with pytest.raises(ValueError, match=r"the event bounce takes place again and again at t = 4\.0637"):
        run(simulation, {"a": np.zeros(500)}, 0.01)
    path = MODELS / "thermostat.toml"
    text = path.read_text().replace("value = 294.0", "value = 293.0")
    simulation = simulation_of(tmp_path, text, {"outdoor": "K", "temperature": "K"})
    with pytest.raises(ValueError, match=r"the event (on|off) takes place .* levels that are further apart"):
        run(simulation, {"outdoor": np.full(50, 278.0)}, 120.0)


@pytest.mark.slow
def test_parameters_that_drift_change_events_too(tmp_path: Path) -> None:
    """In the terms of all mechanisms, which one kernel has, as written into the file."""
    text = BALL.replace('when = "height"', 'when = "height - plate"')
    path = written(
        tmp_path, text.replace("[model.events", 'plate = { value = 0.2, unit = "m" }\n[model.events')
    )
    content, units = read_equations(path), {"a": "m/s^2", "y": "m"}
    plain = equations_simulation(content, units, str(path))
    acting = ("parameter.restitution.drift", "parameter.plate.drift")
    extended = plain.extended(acting)
    values = np.array([one.value for one in extended.parameters])
    values[-2:] = -0.2  # of itself a second
    stimulus = Stimulus(inputs={"a": np.zeros(100)}, holds={"a": "zero"}, period_s=0.02)
    found = extended.predict(stimulus, values).outputs["y"][0]
    assert np.abs(found - plain.predict(stimulus, values[:-2]).outputs["y"][0]).max() > 0.01
    declared = [one.declared for one in extended.parameters[-2:]]
    tables = {
        identity: {one.name: Value(value=-0.2, unit=one.unit)}
        for identity, one in zip(acting, declared, strict=True)
    }
    again = equations_simulation(extended.written(content, tables), units, "written")
    own = np.array([one.value for one in again.parameters])
    np.testing.assert_allclose(again.predict(stimulus, own).outputs["y"][0], found, atol=1e-9)


WHEN, SET = 'when = "height"', 'speed = "-restitution*speed"'
MISTAKES = [
    (WHEN, 'when = "heigth"', 'events.bounce.when = "heigth": "heigth" is unknown; did you mean "height"?'),
    (WHEN, 'when = "height - 1"', 'the term "1" is a plain number, "height" is in m; both need one unit'),
    (WHEN, 'when = "height < 0"', 'such as when = "x - limit" with direction = "rising"'),
    (WHEN, 'when = "restitution - 1"', "it never changes: no state, input, term or time stands in it"),
    (WHEN, 'when = "sqrt(-height)"', 'events.bounce.when = "sqrt(-height)": it is nan at the start'),
    (WHEN, "", 'key "model.events.bounce.when" is missing'),
    (SET, 'speed = "-restitution*height"', 'bounce.set.speed = "-restitution*height": the term "-restitution*height"'),
    (SET, 'sped = "-restitution*speed"', 'bounce.set.sped: the model has no state "sped"; did you mean "speed"?'),
    ('{ speed = "-restitution*speed", bounces = "bounces + 1" }', "{ }", "model.events.bounce.set"),
    ('direction = "falling"', 'direction = "down"', "model.events.bounce.direction"),
    ("[model.events.bounce]", '[model.events."b-1"]', '"b-1" is no name'),
]  # fmt: skip


@pytest.mark.parametrize(("before", "after", "said"), MISTAKES)
def test_a_mistake_in_an_event_is_one_message(tmp_path: Path, before: str, after: str, said: str) -> None:
    assert before in BALL
    path = written(tmp_path, BALL.replace(before, after))
    with pytest.raises(InputError) as caught:
        read_equations(path)
    assert said in str(caught.value)
    assert all(line.startswith(str(path)) for line in str(caught.value).splitlines())
