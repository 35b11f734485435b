"""What a unit is to simulators: valid, with units and state, compiled from its sources elsewhere, refused in words."""

from __future__ import annotations

import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest
from export.fmu_cases import MECHANISMS, oscillator, oscillator_data
from vo2_model_cases import small_model

import rtctl
from rtctl.border.errors import InputError, RunError
from rtctl.cli import main
from rtctl.export.fmu.units import base_unit

fmpy = pytest.importorskip("fmpy")
EXAMPLE = Path("scenarios/models/equations/bouncing_ball.toml")


@pytest.fixture(scope="module", params=["3.0", "2.0"])
def unit(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> rtctl.ExportedFmu:
    folder = tmp_path_factory.mktemp("unit")
    model = oscillator(folder, "friction.coulomb", "drive.lag")
    return rtctl.export_fmu(model, folder / "beam-1.fmu", version=request.param)


def test_a_unit_is_valid_and_has_units_and_bounds(unit: rtctl.ExportedFmu) -> None:
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(unit.path)) == []
    described = fmpy.read_model_description(str(unit.path))
    by_name = {one.name: one for one in described.modelVariables}
    assert described.coSimulation.canSerializeFMUstate
    assert described.coSimulation.canGetAndSetFMUstate
    assert not described.coSimulation.providesDirectionalDerivative
    assert (by_name["displacement"].unit, by_name["friction.coulomb.level"].unit) == ("mm", "mm/s^2")
    assert float(by_name["friction.coulomb.level"].min) == 0.0
    length = next(one.baseUnit for one in described.unitDefinitions if one.name == "mm")
    assert (length.m, length.factor) == (1, pytest.approx(1e-3))


@pytest.mark.parametrize(
    ("unit", "exponents", "factor"),
    [
        ("mm/s^2/V", {"m": -1, "kg": -1, "s": 1, "A": 1}, 1e-3),
        ("mrad", {"rad": 1}, 1e-3),
        ("cm^0.5/s", None, 1.0),
    ],
)
def test_units_are_in_base_units(unit: str, exponents: dict[str, int] | None, factor: float) -> None:
    found = base_unit(unit)
    assert (found and found.exponents) == exponents
    assert found is None or found.factor == pytest.approx(factor)


def stepped(slave: object, at: int, steps: int, drive: int, seen: int) -> list[float]:
    """Return an output after each of some steps under a drive that follows from the number of the step."""
    found = []
    for k in range(at, at + steps):
        level = [float(np.sin(0.15 * k))]
        if isinstance(slave, fmpy.fmi3.FMU3Slave):
            slave.setFloat64([drive], level)
            slave.doStep(currentCommunicationPoint=2e-3 * k, communicationStepSize=2e-3)
            found.append(slave.getFloat64([seen])[0])
        else:
            slave.setReal([drive], level)
            slave.doStep(currentCommunicationPoint=2e-3 * k, communicationStepSize=2e-3)
            found.append(slave.getReal([seen])[0])
    return found


def test_a_restored_state_goes_on_to_the_bit(unit: rtctl.ExportedFmu) -> None:
    description = fmpy.read_model_description(str(unit.path))
    references = {one.name: one.valueReference for one in description.modelVariables}
    folder = fmpy.extract(str(unit.path))
    first, second = (fmpy.instantiate_fmu(folder, description, "CoSimulation") for _ in range(2))
    is_3 = unit.version == "3.0"
    for one in (first, second):
        if not is_3:
            one.setupExperiment(startTime=0.0)
            one.enterInitializationMode()
        else:
            one.enterInitializationMode(startTime=0.0)
        one.exitInitializationMode()
    drive, seen = references["drive"], references["displacement"]
    stepped(first, 0, 40, drive, seen)
    state = first.getFMUState() if is_3 else first.getFMUstate()
    packed = first.serializeFMUState(state) if is_3 else first.serializeFMUstate(state)
    once = stepped(first, 40, 30, drive, seen)
    (first.setFMUState if is_3 else first.setFMUstate)(state)
    assert stepped(first, 40, 30, drive, seen) == once
    other = second.deserializeFMUState(packed) if is_3 else second.deSerializeFMUstate(packed)
    (second.setFMUState if is_3 else second.setFMUstate)(other)
    assert stepped(second, 40, 30, drive, seen) == once  # also in another instance
    assert np.ptp(once) > 1e-3
    for one in (first, second):
        one.terminate()
        one.freeInstance()


@pytest.mark.parametrize("version", ["3.0", "2.0"])
def test_an_input_that_was_set_before_a_copy_counts_after_it(version: str, tmp_path: Path) -> None:
    model = tmp_path / "through.toml"
    model.write_text(
        '[model]\nkind = "equations"\n[model.inputs]\nu = { unit = "V" }\n[model.states]\n'
        'x = { unit = "V", rate = "(u - x)/tau" }\n[model.outputs]\ny = { unit = "V", value = "x + 2*u" }\n'
        '[model.parameters]\ntau = { value = 1.0, unit = "s" }\n',
        encoding="utf-8",
    )
    made = rtctl.export_fmu(model, tmp_path / "through.fmu", version=version)
    description = fmpy.read_model_description(str(made.path))
    references = {one.name: one.valueReference for one in description.modelVariables}
    one = fmpy.instantiate_fmu(fmpy.extract(str(made.path)), description, "CoSimulation")
    is_3 = version == "3.0"
    set_to, get = (one.setFloat64, one.getFloat64) if is_3 else (one.setReal, one.getReal)
    if not is_3:
        one.setupExperiment(startTime=0.0)
    one.enterInitializationMode()
    one.exitInitializationMode()
    set_to([references["u"]], [3.0])
    copy = one.getFMUState() if is_3 else one.getFMUstate()
    set_to([references["u"]], [5.0])
    assert get([references["y"]]) == [10.0]
    (one.setFMUState if is_3 else one.setFMUstate)(copy)
    assert get([references["y"]]) == [6.0]
    one.terminate()
    one.freeInstance()


def test_parameters_are_tuned_while_it_runs(unit: rtctl.ExportedFmu) -> None:
    given = {"drive": 1.0, "friction.coulomb.level": 0.0, "stiffness": 5000.0, "stiffness_cubic": 0.0}
    ran = fmpy.simulate_fmu(str(unit.path), stop_time=8.0, output=["displacement"], start_values=given)
    assert ran["displacement"][-1] == pytest.approx(300.0 / 5000.0, rel=1e-4)


@pytest.mark.parametrize("version", ["3.0", "2.0"])
def test_sources_are_plain_c99_without_a_warning(version: str, tmp_path: Path) -> None:
    from rtctl.models.vo2 import save_model

    save_model(tmp_path / "vo2.toml", small_model())
    data = oscillator_data(tmp_path)
    for model, records in (
        (oscillator(tmp_path, cubic=600.0), data),  # a splitting
        (oscillator(tmp_path, *(one for one in MECHANISMS if " " not in one)), data),
        (oscillator(tmp_path), data),
        (EXAMPLE, None),
        (tmp_path / "vo2.toml", None),
    ):
        made = rtctl.export_fmu(
            model, tmp_path / "a.fmu", version=version, dataset=records, sources_only=True
        )
        with zipfile.ZipFile(made.path) as archive:
            names = archive.namelist()
            archive.extractall(tmp_path / "unpacked")
        assert not made.has_binary
        assert not any(name.startswith("binaries") for name in names)
        sources = [name for name in names if name.endswith(".c")]
        strict = ["gcc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O1", "-c"]
        done = subprocess.run(
            [*strict, *sources], cwd=tmp_path / "unpacked", capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr


def test_input_derivatives_of_fmi_2_are_slopes(tmp_path: Path) -> None:
    import ctypes

    unit = rtctl.export_fmu(oscillator(tmp_path), tmp_path / "a.fmu", version="2.0", step_s=2e-3)
    description = fmpy.read_model_description(str(unit.path))
    references = {one.name: one.valueReference for one in description.modelVariables}
    folder = fmpy.extract(str(unit.path))
    ends = []
    for by_derivative in (True, False):
        slave = fmpy.instantiate_fmu(folder, description, "CoSimulation")
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        if by_derivative:
            drive, order = (ctypes.c_uint * 1)(references["drive"]), (ctypes.c_int * 1)(1)
            slave.fmi2SetRealInputDerivatives(slave.component, drive, 1, order, (ctypes.c_double * 1)(200.0))
        else:
            slave.setReal([references["drive_slope"]], [200.0])
        slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=5e-3)
        ends.append(slave.getReal([references["displacement"]])[0])
        slave.terminate()
        slave.freeInstance()
    assert ends[0] == ends[1]
    assert ends[0] > 1e-4


def test_two_exports_are_the_same_to_the_bit(tmp_path: Path) -> None:
    one, other = (rtctl.export_fmu(EXAMPLE, tmp_path / name / "a.fmu").path for name in ("x", "y"))
    assert one.read_bytes() == other.read_bytes()


def test_what_cannot_be_exported_is_named_with_its_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = oscillator(tmp_path)
    model.write_text(
        model.read_text()
        + '[[model.mechanisms]]\nid = "timing.skew"\nparameters = { late = { value = 1.0, unit = "ms" } }\n'
    )
    assert main(["export", "fmu", "--model", str(model), "--out", str(tmp_path / "a.fmu")]) == 2
    said = capsys.readouterr().err
    assert "timing.skew has no form in C: the reading of a row at another instant" in said
    assert str(model) in said
    assert not (tmp_path / "a.fmu").exists()


def test_wrong_arguments_are_refused_in_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, words in (
        (["fmu", "--out", "a.fmu"], "fmu: a model is needed"),
        (["fmu", "run", "--model", str(EXAMPLE), "--out", "a.fmu"], "a unit is made of a model alone"),
        (["mcap", "--out", "a.mcap"], "mcap: the folder of a run is needed"),
        (["fmu", "--model", str(EXAMPLE), "--out", "a.zip"], 'is a file "*.fmu"'),
        (["fmu", "--model", str(EXAMPLE), "--out", "a.fmu", "--step", "1 mm"], "--step"),
        (["fmu", "--model", "no_model.toml", "--out", "a.fmu"], "no_model.toml"),
    ):
        assert main(["export", *arguments]) == 2, arguments
        assert words in capsys.readouterr().err


def test_a_missing_and_a_failing_compiler_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"no C compiler: gcc, cc or clang is needed.*--sources-only"):
        rtctl.export_fmu(EXAMPLE, tmp_path / "a.fmu")
    failing = tmp_path / "gcc"
    failing.write_text("#!/bin/sh\necho 'plant.c:1: no space' >&2\nexit 3\n")
    failing.chmod(0o755)
    with pytest.raises(RunError, match=r"exit code 3\):\nplant.c:1: no space\n.*--sources-only"):
        rtctl.export_fmu(EXAMPLE, tmp_path / "a.fmu")
    assert not (tmp_path / "a.fmu").exists()


def test_a_name_that_would_stand_twice_is_refused(tmp_path: Path) -> None:
    model = tmp_path / "m.toml"
    text = Path("scenarios/models/equations/oscillator.toml").read_text()
    model.write_text(text.replace("damping", "drive_slope"))
    with pytest.raises(InputError, match='"drive_slope" would stand twice'):
        rtctl.export_fmu(model, tmp_path / "a.fmu")
