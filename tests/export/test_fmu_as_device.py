"""A unit as a device: it moves as the model does that it was made of, on a wire too; what it cannot be is told."""

from __future__ import annotations

import math
import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest
from wire_cases import served_process

import rtctl
from plant_sim.equations.plant import load_plant as load_equations
from plant_sim.fmu.plant import load_plant as load_unit
from rtctl.border.errors import InputError
from rtctl.cli import main
from rtctl.wiring import load_plant

pytest.importorskip("fmpy")
MODEL = Path("scenarios/models/equations/voice_coil.toml")


@pytest.fixture(scope="module", params=["3.0", "2.0"])
def unit(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("unit") / "voice_coil.fmu"
    return rtctl.export_fmu(MODEL, path, version=request.param, step_s=1e-3).path


def test_a_unit_moves_as_the_device_of_its_model(unit: Path) -> None:
    here, there = load_plant(unit), load_equations(MODEL)
    assert [one.name for one in here.profile.commands] == [one.name for one in there.profile.commands]
    assert [one.unit for one in here.profile.commands] == [one.unit for one in there.profile.commands]
    outputs = list(rtctl.dynamics(MODEL).outputs)
    assert [one.name for one in here.profile.sensed] == outputs
    levels = 0.3 * np.sin(0.2 * np.arange(200))
    for level in levels:
        found, _ = here.step([float(level)], 1e-3)
        there.advance([float(level)], 1e-3)
        np.testing.assert_allclose(found, there.truth()[: len(outputs)], rtol=1e-5, atol=1e-8)
    assert abs(found[0]) > 0.0
    here.reset()
    again, _ = here.step([float(levels[0])], 1e-3)
    there.reset()
    there.advance([float(levels[0])], 1e-3)
    np.testing.assert_allclose(again, there.truth()[: len(outputs)], rtol=1e-5, atol=1e-8)


def test_a_unit_that_fails_reads_no_numbers_and_tells_why(
    unit: Path, caplog: pytest.LogCaptureFixture
) -> None:
    device = load_unit(unit)
    device._slave.doStep = _failing  # the unit's own code may do anything
    readings, reference = device.step([0.1], 1e-3)
    assert all(math.isnan(one) for one in (*readings, reference))
    assert "the unit failed at 0 s: boom" in caplog.text
    device.reset()
    assert math.isfinite(device.measure()[1])


def _failing(**arguments: object) -> None:
    raise RuntimeError("boom")


def changed(unit: Path, folder: Path, old: str, new: str) -> Path:
    """Return a copy of a unit with another text in its description; `old` "binaries": without these."""
    target = folder / "changed.fmu"
    with zipfile.ZipFile(unit) as source, zipfile.ZipFile(target, "w") as archive:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                content = content.replace(old.encode(), new.encode())
            if old != "binaries" or not name.startswith("binaries"):
                archive.writestr(name, content)
    return target


def test_what_cannot_be_a_device_is_told_with_its_reason(unit: Path, tmp_path: Path) -> None:
    is_3 = "<Float64" in zipfile.ZipFile(unit).read("modelDescription.xml").decode()
    cases = [
        ("binaries", "", "no binary for this machine"),
        ('causality="output"', 'causality="local"', "no output"),
    ]
    if is_3:
        cases += [
            ('fmiVersion="3.0"', 'fmiVersion="4.0"', "no functional mock-up unit that FMPy reads|not known")
        ]
    else:
        cases += [
            (
                'canRunAsynchronuously="false"',
                'needsExecutionTool="true"',
                "needs the tool that it comes from",
            )
        ]
    for old, new, words in cases:
        with pytest.raises(InputError, match=words):
            load_unit(changed(unit, tmp_path, old, new))
    (tmp_path / "text.fmu").write_text("no archive")
    with pytest.raises(InputError, match="no functional mock-up unit that FMPy reads"):
        load_unit(tmp_path / "text.fmu")
    with pytest.raises(InputError, match="no such file"):
        load_unit(tmp_path / "missing.fmu")


def test_a_plant_file_names_a_unit(unit: Path, tmp_path: Path) -> None:
    shutil.copy(unit, tmp_path / "a.fmu")
    (tmp_path / "plant.toml").write_text('[plant]\nkind = "fmu"\nfile = "a.fmu"\n')
    assert load_plant(tmp_path / "plant.toml").identity == "a"
    (tmp_path / "plant.toml").write_text('[plant]\nkind = "fmu"\n')
    with pytest.raises(InputError, match=r'key "plant\.file" must name a unit'):
        load_plant(tmp_path / "plant.toml")


SCENARIO = """
[scenario]
title = "a unit, recorded"
plant = "equations"
model = "oscillator.toml"
period = "2 ms"

[limits]
low = "-2 V"
high = "2 V"
safe = "0 V"
sensed_low = "-10 mm"
sensed_high = "10 mm"

[[excitation]]
kind = "random_multisine"
use = "fit"
duration = "0.8 s"
frequency_low = "5 Hz"
frequency_high = "30 Hz"
amplitude = "30 %"
seed = 1
"""


@pytest.mark.wire
def test_a_served_unit_is_recorded_and_its_model_is_right_about_it(tmp_path: Path) -> None:
    equations = Path("scenarios/models/equations/oscillator.toml")
    shutil.copy(equations, tmp_path / "oscillator.toml")
    rtctl.export_fmu(equations, tmp_path / "beam.fmu", step_s=2e-3)
    (tmp_path / "scenario.toml").write_text(SCENARIO)
    with served_process(str(tmp_path / "beam.fmu"), "modbus-tcp", tmp_path) as served:
        words = [
            "acquire",
            str(tmp_path / "scenario.toml"),
            "--out",
            str(tmp_path / "data"),
            *served.settings,
        ]
        assert main(words) == 0
    compared = rtctl.simulate(equations, tmp_path / "data" / "dataset.toml")
    assert compared.scores[0].rms_variation > 0.02
    assert compared.scores[0].share < 1e-4
