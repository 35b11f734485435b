"""Models with events beyond their simulation: identified, diagnosed, estimated, in a loop, as a device."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from equation_cases import written

import rtctl
from plant_sim.equations.controlled import ControlledEquations
from plant_sim.equations.plant import load_plant
from rtctl import Record
from rtctl.border.arrays import FloatArray
from rtctl.estimators.cubature import CubatureFilter
from rtctl.plants.equations.belief import filter_settings

MODELS = Path(__file__).resolve().parents[2] / "scenarios" / "models" / "equations"
STOP = """
[model]
kind = "equations"
[model.inputs]
force = { unit = "N" }
[model.states]
z = { unit = "mm", rate = "v" }
v = { unit = "mm/s", rate = "(force - k*z - c*v)/m" }
hits = { unit = "1", rate = 0 }
[model.outputs]
strain = { unit = "1", value = "z/span" }
place = { unit = "mm", value = "z" }
[model.parameters]
k = { value = 900.0, unit = "N/m" }
c = { value = 0.6, unit = "N*s/m" }
m = { value = 10.0, unit = "g" }
span = { value = 50.0, unit = "mm" }
stop = { value = 1.2, unit = "mm" }
back = { value = 0.7, unit = "1" }
[model.events.hit]
when = "z - stop"
direction = "rising"
set = { v = "-back*v", hits = "hits + 1" }
[device]
reference = "place"
[device.inputs.force]
low = -2.0
high = 2.0
[device.outputs.strain]
noise = 1e-3
[device.outputs.place]
sensed = false
low = -1.5
high = 1.1
"""


def estimated(path: Path, model: ControlledEquations) -> tuple[FloatArray, FloatArray]:
    """Places [mm] of a device that hits its stop, and what a filter tells of them."""
    plant, of_filter = load_plant(path, seed=3), CubatureFilter(model, filter_settings(model))
    plant.reset()
    of_filter.start((0.0,), plant.measure()[0])
    place, told = [], []
    for k in range(400):
        force = (0.9,) if (k // 50) % 2 else (0.0,)
        sensed, reference = plant.step(force, 1e-3)
        place.append(reference)
        told.append(of_filter.step(force, sensed, 1e-3).value)
    return np.array(place), np.array(told)


@pytest.mark.slow
def test_a_filter_with_events_follows_a_device_that_hits_its_stop(tmp_path: Path) -> None:
    path = written(tmp_path, STOP)
    model = ControlledEquations(path)
    place, told = estimated(path, model)
    assert place.max() < 1.2 + 1e-9
    error = np.sqrt(np.mean((told - place)[50:] ** 2))
    assert error < 0.025  # mm, of a reading with 0.05 mm of noise
    blind = ControlledEquations(
        written(tmp_path, STOP[: STOP.index("[model.events")] + STOP[STOP.index("[device]") :], "blind.toml")
    )
    assert np.sqrt(np.mean((estimated(path, blind)[1] - place)[50:] ** 2)) > 3.0 * error
    assert place[60:100].max() > 1.19


@pytest.mark.slow
def test_a_filter_follows_bounces_through_readings_that_are_beyond_the_plate(tmp_path: Path) -> None:
    text = (MODELS / "bouncing_ball.toml").read_text().replace("value = 0.8,", "value = 0.95,")
    text += "[device.inputs.acceleration]\nlow = -5\nhigh = 5\n[device.outputs.gap]\nnoise = 5.0\n"
    path, errors = written(tmp_path, text), []
    for seed in range(2):
        plant, model = load_plant(path, seed=seed), ControlledEquations(path)
        plant.reset()
        of_filter = CubatureFilter(model, filter_settings(model))
        of_filter.start((0.0,), plant.measure()[0])
        of_filter._x = model.initial.copy()
        for _ in range(400):
            sensed, gap = plant.step((0.0,), 5e-3)
            errors.append(of_filter.step((0.0,), sensed, 5e-3).value - gap)
    assert np.sqrt(np.mean(np.square(errors))) < 2.15  # mm, of readings with 5 mm of noise


def scenario(model: Path) -> dict[str, Any]:
    return {
        "scenario": {"title": "stop", "plant": "equations", "model": str(model), "period": "2 ms", "duration": "0.6 s"},
        "limits": {"low": "-2 N", "high": "2 N", "safe": "0 N", "sensed_low": -0.1, "sensed_high": 0.1},
        "reference": {"kind": "steps", "levels": ["0 mm", "1 mm"], "hold": "300 ms"},
        "estimator": {"kind": "kalman"},
    }  # fmt: skip


def test_a_loop_holds_a_device_with_events(tmp_path: Path) -> None:
    run = rtctl.run(scenario(written(tmp_path, STOP)))
    assert run.fault is None
    assert run.summary["self_sensing"]["mean_abs_percent"] < 1.0
    assert abs(run.signals["place"][-1] - 1.0) < 0.02


def test_a_switch_is_known_to_the_filter(tmp_path: Path) -> None:
    text = (
        MODELS / "thermostat.toml"
    ).read_text() + "[device.inputs.outdoor]\nlow = 260\nhigh = 300\nsafe = 280\n"
    text += "[device.outputs.temperature]\nnoise = 0.05\n[device.outputs.drawn]\nnoise = 1e3\n"
    path = written(tmp_path, text)
    plant, model = load_plant(path, seed=1), ControlledEquations(path)
    of_filter = CubatureFilter(model, filter_settings(model))
    of_filter.start((280.0,), plant.measure()[0])
    of_filter._x = model.initial.copy()  # the thermostat itself never rests
    seen = []
    for _ in range(200):
        sensed, _ = plant.step((280.0,), 60.0)
        of_filter.step((280.0,), sensed, 60.0)
        seen.append((of_filter._x[1], plant._x[1, 0], of_filter._x[0] - plant._x[0, 0]))
    told, true, off = np.array(seen).T
    assert set(told) == {0.0, 1.0}
    assert np.mean(told != true) < 0.1  # it switches a sample early or late
    assert np.sqrt(np.mean(off**2)) < 0.05


def dataset_of(
    folder: Path, text: str, name: str, period_s: float, sources: list[FloatArray], noise: float
) -> Any:
    """Records of a device of one input and one output, of which the last is the test's."""
    samples = len(sources[0])
    path = written(folder, text, f"{name}_device.toml")
    model = rtctl.read_model(path).content.model
    source, output = next(iter(model.inputs)), next(iter(model.outputs))
    units = {source: model.inputs[source].unit, output: model.outputs[output].unit}
    uses = ["fit"] * (len(sources) - 1) + ["test"]
    blank = [
        Record(name=f"r{k}", period_s=period_s, use=use, signals={source: one, output: np.zeros(samples)})
        for k, (one, use) in enumerate(zip(sources, uses, strict=True))
    ]
    kinds: dict[str, Any] = {"name": name, "plant": "equations", "units": units, "holds": {source: "zero"}}
    made = rtctl.write_dataset(folder / f"{name}_blank", blank, **kinds)
    truth, random = rtctl.simulate(path, made), np.random.default_rng(1)
    measured = [
        Record(
            name=one.name, period_s=period_s, use=one.use,
            signals={
                source: one.signals[source],
                output: truth.records[one.name].simulated[output] + noise * random.standard_normal(samples),
            },
        )
        for one in made.records
    ]  # fmt: skip
    return rtctl.write_dataset(folder / name, measured, **kinds)


def test_a_restitution_is_identified_from_bounces(tmp_path: Path) -> None:
    text = (MODELS / "bouncing_ball.toml").read_text()
    sources = [3.0 * np.sin(0.05 * np.arange(150) + k) for k in range(3)]
    data = dataset_of(tmp_path, text, "ball", 5e-3, sources, 0.1)
    start = written(tmp_path, text.replace("restitution = { value = 0.8", "restitution = { value = 0.65"))
    fit = rtctl.identify(data, model=start)
    assert fit.model.parameters["restitution"].value == pytest.approx(0.8, abs=2e-4)
    fit.save(tmp_path / "fitted.toml")
    again = rtctl.read_model(tmp_path / "fitted.toml")
    assert again.content.model.events == rtctl.read_model(start).content.model.events


def test_what_a_thermostat_lacks_is_named(tmp_path: Path) -> None:
    text = (MODELS / "thermostat.toml").read_text()
    for name in ("power   ", "loss    ", "capacity", "low     ", "high    "):
        text = text.replace(f"{name} = {{ ", f"{name} = {{ fixed = true, ")
    sunny = text.replace("(room - outdoor))/capacity", "(room - outdoor) + sun)/capacity")
    sunny = sunny.replace("[model.parameters]", '[model.parameters]\nsun = { value = 120, unit = "W" }')
    random, k = np.random.default_rng(0), np.arange(300)
    sources = [278 + 6 * np.sin(k / 25 + one) + np.repeat(random.uniform(-3, 3, 15), 20) for one in range(3)]
    data = dataset_of(tmp_path, sunny, "room", 60.0, sources, 0.02)
    found = rtctl.diagnose(data, written(tmp_path, text, "known.toml"))
    assert found.verdict == "explained"
    assert found.causes[0].id == "state.room.input"
    assert found.model.content.model.events.keys() == {"off", "on"}
    assert found.model.parameters["room_input_constant"].value == pytest.approx(120 / 4e5, rel=0.01)


def test_a_device_whose_events_do_not_end_says_so_and_reads_nothing(tmp_path: Path, caplog: Any) -> None:
    text = (MODELS / "thermostat.toml").read_text().replace("value = 294.0", "value = 293.0")
    plant = load_plant(written(tmp_path, text))
    sensed, reference = plant.step((278.0,), 600.0)
    assert re.search(r"model\.toml: the event o\w+ takes place again and again at t = \d+", caplog.text)
    assert np.isnan([*sensed, reference]).all()
    assert np.isnan(plant.step((278.0,), 600.0)[1])
