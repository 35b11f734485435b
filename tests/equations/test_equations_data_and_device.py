"""Around the equations: manifests whose signals the model names, files on the command line, the model as a device."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from equation_cases import OSCILLATOR, TANKS, simulation_of, written

import rtctl
from plant_sim.equations.plant import load_plant
from rtctl.border.errors import InputError
from rtctl.border.simulation import Stimulus
from rtctl.cli import main
from rtctl.measured.dataset import Record
from rtctl.wiring import build_device

MANIFEST = """
[dataset]
name = "two tanks"
plant = "equations"
[signals.u]
role = "input"
unit = "mV"
hold = "zero"
column = "pump"
[signals.y]
role = "output"
unit = "mV"
[[records]]
file = "a.csv"
sample_rate_hz = 0.25
initial = { x1 = "4 cm", x2 = "20 mm" }
"""


def measured(folder: Path, manifest: str = MANIFEST) -> Path:
    rows = ["pump,y"] + [f"{3000 + 10 * k},{2000 + k}" for k in range(20)]
    written(folder, "\n".join(rows), "a.csv")
    return written(folder, manifest, "dataset.toml")


def test_signals_and_starts_are_those_that_the_model_names(tmp_path: Path) -> None:
    data = rtctl.read_dataset(measured(tmp_path))
    assert dict(data.units) == {"u": "mV", "y": "mV"}
    assert dict(data.holds) == {"u": "zero"}
    assert data.records[0].initial == pytest.approx({"x1": 0.04, "x2": 0.02})
    compared = rtctl.simulate(written(tmp_path, TANKS), data)
    simulated = compared.records["a"].simulated["y"]
    assert simulated[0] == pytest.approx(0.8 * 2.0 * 1000.0)


def test_a_dataset_is_written_with_its_starts(tmp_path: Path) -> None:
    signals = {"drive": np.arange(5.0), "level": np.arange(5.0), "other": np.ones(5)}
    record = Record(name="r", period_s=0.1, signals=signals, initial={"x1": 0.04})
    data = rtctl.write_dataset(
        tmp_path, [record], name="d", plant="equations", units={"drive": "V", "level": "cm", "other": "K"},
        holds={"drive": "linear"},
    )  # fmt: skip
    assert {name: one.role for name, one in data.signals.items()} == {
        "drive": "input", "level": "output", "other": "output",
    }  # fmt: skip
    assert data.records[0].initial == {"x1": 0.04}


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ('x1 = "4 cm"', "x1 = 4", "a quantity is"),
        ('x1 = "4 cm"', 'x1 = "4"', "a quantity is"),
        ('x1 = "4 cm"', 'x1 = "4 parsnips"', 'unknown unit "parsnips"'),
        ('role = "output"', 'role = "input"', "no output is there"),
        ('unit = "mV"\nhold', 'unit = "dBV"\nhold', "signals.u.unit"),
        ('role = "input"', 'role = "inptu"', "did you mean"),
        ('column = "pump"', 'column = "pumpe"', 'did you mean "pump"'),
    ],
)
def test_a_wrong_manifest_is_told(tmp_path: Path, before: str, after: str, said: str) -> None:
    path = measured(tmp_path, MANIFEST.replace(before, after))
    with pytest.raises(InputError) as caught:
        rtctl.read_dataset(path)
    assert said in str(caught.value)


def test_an_unknown_state_of_a_record_is_told_by_the_model(tmp_path: Path) -> None:
    path = measured(tmp_path, MANIFEST.replace("x1 = ", "x3 = "))
    with pytest.raises(InputError, match=r'initial\.x3: the model has no state "x3"'):
        rtctl.simulate(written(tmp_path, TANKS), path)


def test_simulate_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, model = measured(tmp_path), written(tmp_path, TANKS)
    assert (
        main(["simulate", str(model), str(path), "--out", str(tmp_path / "out"), "--no-plot", "--quiet"]) == 0
    )
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary["records"][0]["outputs"]["y"]["unit"] == "mV"
    capsys.readouterr()
    wrong = written(tmp_path, TANKS.replace("c*x2", "c*x3"), "wrong.toml")
    assert main(["simulate", str(wrong), str(path), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert str(wrong) in said
    assert "Traceback" not in said


def test_the_model_as_a_device_moves_as_its_simulation(tmp_path: Path) -> None:
    model = written(
        tmp_path, OSCILLATOR + '[device]\nname = "own"\n[device.inputs.drive]\nlow = -5\nhigh = 5\n'
    )
    plant = build_device(str(model), tmp_path, 3)
    assert plant.identity == "own"
    assert (plant.low, plant.high, plant.safe) == ((-5.0,), (5.0,), (0.0,))
    assert [one.name for one in plant.profile.channels] == ["drive", "displacement", "reference_displacement"]
    u = np.random.default_rng(0).standard_normal(400)
    read = [plant.step((level,), 2e-3)[0][0] for level in u]
    simulation = simulation_of(tmp_path, OSCILLATOR, {"drive": "V", "displacement": "mm"})
    stimulus = Stimulus(inputs={"drive": np.append(u, 0.0)}, holds={"drive": "zero"}, period_s=2e-3)
    values = np.array([one.value for one in simulation.parameters])
    expected = simulation.predict(stimulus, values).outputs["displacement"][0, 1:]
    assert np.abs(read - expected).max() < 1e-5 * np.ptp(expected)


def test_a_plant_file_names_the_model_and_noise_repeats(tmp_path: Path) -> None:
    written(tmp_path, TANKS + "[device.outputs.y]\nnoise = 0.1\n")
    path = written(tmp_path, '[plant]\nkind = "equations"\nmodel = "model.toml"\n', "plant.toml")
    plant = build_device(str(path), tmp_path, 1)
    first = [plant.step((3.0,), 4.0) for _ in range(5)]
    plant.reset()
    assert [plant.step((3.0,), 4.0) for _ in range(5)] == first
    assert 0.0 < abs(first[0][0][0] - first[0][1]) < 0.5


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[device.inputs.v]\nlow = -1\n", 'unknown key "device.inputs.v"'),
        ('[device]\nreference = "z"\n', 'no output "z"'),
        ("[device.outputs.y]\nnois = 1\n", 'did you mean "noise"'),
        ("[device.inputs.u]\nlow = 1\n", "must rise in this order"),
    ],
)
def test_a_wrong_device_table_is_told(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        load_plant(written(tmp_path, TANKS + text))
    assert said in str(caught.value)


def test_a_scenario_of_equations_is_refused_in_words(tmp_path: Path) -> None:
    path = written(
        tmp_path, '[scenario]\ntitle = "t"\nplant = "equations"\nduration = "1 s"\n', "scenario.toml"
    )
    with pytest.raises(InputError, match=r'"scenario\.model" is missing'):
        rtctl.acquire(path, tmp_path / "out")
