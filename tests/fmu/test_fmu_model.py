"""A functional mock-up unit as a model: run beside the equations that it is made of, identified, written, refused."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path
from threading import Thread
from types import SimpleNamespace

import numpy as np
import pytest
from fmu_units import DESCRIPTION, MODEL, PERIOD_S, heater_course, write_heater, write_heater_data

import rtctl
from plant_sim.equations.model import equations_simulation
from plant_sim.equations.reading import read_equations
from plant_sim.equations.simulation import EquationsSimulation
from plant_sim.fmu.plant import load_plant
from plant_sim.fmu.reading import read_fmu_model
from plant_sim.fmu.simulation import FmuSimulation, fmu_simulation
from plant_sim.fmu.unit import read_unit, unit_text
from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.border.simulation import Stimulus
from rtctl.cli import main

pytest.importorskip("fmpy")
pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
BEAM = """
[model]
kind = "equations"
[model.inputs]
force = { unit = "N" }
[model.states]
z = { unit = "mm", rate = "v" }
v = { unit = "mm/s", rate = "(force - stiff*z - k3*z^3 - c*v)/m", initial = 3.0 }
[model.terms]
stiff = "k"
[model.outputs]
place = { unit = "mm", value = "z" }
spring = { unit = "N", value = "k*z + f*force" }
[model.parameters]
k = { value = 900.0, unit = "N/m" }
k3 = { value = 300.0, unit = "N/m/mm^2" }
c = { value = 1.2, unit = "N*s/m" }
m = { value = 10.0, unit = "g" }
f = { value = 0.3, unit = "1" }
rate = { value = 0.0, unit = "1/s" }
by = { value = 0.0, unit = "1/N" }
"""
UNITS = {"force": "mN", "place": "um", "spring": "N"}
SAMPLES = 400


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The beam as equations and as units of both versions, and the heater of another hand."""
    made = tmp_path_factory.mktemp("units")
    (made / "beam.toml").write_text(BEAM, encoding="utf-8")
    for version in ("2.0", "3.0"):
        rtctl.export_fmu(made / "beam.toml", made / f"beam{version[0]}.fmu", version=version, step_s=1e-3)
    write_heater(made)
    (made / "heater.toml").write_text(MODEL, encoding="utf-8")
    return made


def record(hold: str, *, after: frozenset[str] = frozenset()) -> Stimulus:
    t = 1e-3 * np.arange(SAMPLES)
    force = 400.0 * np.sin(60.0 * t) + 300.0 * np.sign(np.sin(23.0 * t + 0.4))
    return Stimulus(inputs={"force": force}, holds={"force": hold}, period_s=1e-3, after_jumps=after)


def equations_of(folder: Path, text: str = BEAM) -> EquationsSimulation:
    path = folder / "changed.toml"
    path.write_text(text, encoding="utf-8")
    return equations_simulation(read_equations(path), UNITS, "beam")


def unit_of(folder: Path, version: str = "3") -> FmuSimulation:
    return fmu_simulation(read_fmu_model(folder / f"beam{version}.fmu"), UNITS, "beam")


def values_of(simulation: EquationsSimulation, **changed: float) -> FloatArray:
    return np.array([changed.get(one.name.replace(".", "_"), one.value) for one in simulation.parameters])


@pytest.mark.parametrize("version", ["2", "3"])
@pytest.mark.parametrize(("hold", "share"), [("zero", 1e-5), ("linear", 1e-5), ("band-limited", 1e-3)])
def test_a_unit_runs_as_the_equations_that_it_is_made_of(
    folder: Path, version: str, hold: str, share: float
) -> None:
    equations, unit = equations_of(folder), unit_of(folder, version)
    assert unit.state == equations.state == ("z", "v")
    assert unit.outputs == equations.outputs
    initial = np.array([[0.1, -2.0]])
    for start in (None, initial):
        wanted = equations.predict(record(hold), values_of(equations, c=1.5), start)
        found = unit.predict(record(hold), values_of(unit, c=1.5), start)
        assert found.diverged_at.tolist() == [-1]
        for name, course in wanted.outputs.items():
            assert np.abs(found.outputs[name] - course).max() < share * np.ptp(course), name


def test_outputs_are_read_before_or_after_a_jump(folder: Path) -> None:
    equations, unit = equations_of(folder), unit_of(folder)
    for after in (frozenset[str](), frozenset({"spring"})):
        wanted = equations.predict(record("zero", after=after), values_of(equations)).outputs["spring"]
        found = unit.predict(record("zero", after=after), values_of(unit)).outputs["spring"]
        assert np.abs(found - wanted).max() < 1e-5 * np.ptp(wanted)


@pytest.mark.parametrize(
    ("identity", "values", "share"),
    [
        ("input.force.lag", {"time_constant": 4e-3}, 1e-3),
        ("input.force.saturation", {"curvature": 2e-6}, 1e-5),
        ("input.force.delay", {"delay": 2.5e-3}, 1e-3),
        ("output.place.lag", {"time_constant": 5e-3}, 2e-3),
        ("output.place.skew", {"late": 1.5e-3}, 1e-3),
        ("output.place.drift", {"rate": 40.0, "settling_time": 0.0}, 1e-5),
    ],
)
def test_mechanisms_around_a_unit_are_those_around_equations(
    folder: Path, identity: str, values: dict[str, float], share: float
) -> None:
    simulations = [one.extended((identity,)) for one in (equations_of(folder), unit_of(folder))]
    found = []
    for one in simulations:
        own = {f"{identity}.{name}".replace(".", "_"): value for name, value in values.items()}
        found.append(one.predict(record("zero"), values_of(one, **own)).outputs["place"])  # type: ignore[arg-type]
    plain = simulations[0].predict(record("zero"), values_of(simulations[0])).outputs["place"]
    assert np.abs(found[0] - plain).max() > 0.01 * np.ptp(plain), "it does something"
    assert np.abs(found[1] - found[0]).max() < share * np.ptp(plain)


def test_a_parameter_drifts_and_depends_while_the_unit_runs(folder: Path) -> None:
    unit = unit_of(folder).extended(("parameter.k.drift", "parameter.k.dependence"))
    changed = BEAM.replace('stiff = "k"', 'stiff = "k*(1 + rate*t + by*force)"').replace(
        "k*z + f*force", "stiff*z + f*force"
    )
    equations = equations_of(folder, changed)
    wanted = equations.predict(record("zero"), values_of(equations, rate=0.8, by=0.4)).outputs["place"]
    found = unit.predict(
        record("zero"), values_of(unit, parameter_k_drift_rate=0.8, parameter_k_dependence_force=0.4e-3)
    ).outputs["place"]
    plain = equations.predict(record("zero"), values_of(equations)).outputs["place"]
    assert np.abs(wanted - plain).max() > 0.1 * np.ptp(plain)
    assert np.abs(found - wanted).max() < 2e-3 * np.ptp(plain)


def test_runs_from_several_threads_are_those_of_one(folder: Path) -> None:
    unit = unit_of(folder)
    wanted = [unit.predict(record("zero"), values_of(unit, c=0.5 + k)).outputs["place"] for k in range(6)]
    found: dict[int, FloatArray] = {}

    def run(k: int) -> None:
        for _ in range(5):
            found[k] = unit.predict(record("zero"), values_of(unit, c=0.5 + k)).outputs["place"]

    threads = [Thread(target=run, args=(k,)) for k in range(6)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert all(np.array_equal(found[k], wanted[k]) for k in range(6))


def test_the_unit_of_another_hand_runs_as_its_equations_say(folder: Path) -> None:
    unit = fmu_simulation(read_fmu_model(folder / "heater.toml"), {"power": "W", "reading": "K"}, "heater")
    assert unit.state == ()
    assert not any(one.startswith("parameter.") for one in unit.catalogue), (
        "its parameters are fixed while it runs"
    )
    power = np.repeat([0.0, 30.0, 10.0], 100)
    stimulus = Stimulus(inputs={"power": power}, holds={"power": "zero"}, period_s=PERIOD_S)
    found = unit.predict(stimulus, np.array([22.0, 0.45, 0.5])).outputs["reading"][0]
    wanted = heater_course(power)
    assert np.abs(found - wanted).max() < 2e-3 * np.ptp(wanted)  # it takes Euler's steps of 1 ms


def test_steps_that_the_samples_do_not_fit_are_named(folder: Path) -> None:
    unit = fmu_simulation(read_fmu_model(folder / "heater.toml"), {"power": "W", "reading": "K"}, "heater")
    stimulus = Stimulus(inputs={"power": np.zeros(20)}, holds={"power": "zero"}, period_s=0.015)
    with pytest.raises(
        ValueError, match=r"communication steps of 0\.01 s alone, and the samples are 0\.015 s"
    ):
        unit.predict(stimulus, values_of(unit))


def test_a_unit_that_refuses_its_parameters_diverges_and_runs_again(folder: Path) -> None:
    unit = fmu_simulation(read_fmu_model(folder / "heater.toml"), {"power": "W", "reading": "K"}, "heater")
    stimulus = Stimulus(inputs={"power": np.full(50, 5.0)}, holds={"power": "zero"}, period_s=PERIOD_S)
    used = unit.runs._slave
    made = unit.predict(stimulus, np.array([[-1.0, 0.5, 0.4], [20.0, 0.5, 0.4]]))
    assert made.diverged_at.tolist() == [0, -1]
    assert unit.runs._slave is used, "an error that a reset mends leaves no instance behind"


def test_finer_steps_are_asked_of_units_alone_that_take_them(folder: Path) -> None:
    """`rtctl simulate` asks for them, to tell what the integrator adds to the error."""
    fixed = fmu_simulation(read_fmu_model(folder / "heater.toml"), {"power": "W", "reading": "K"}, "heater")
    stimulus = Stimulus(inputs={"power": np.full(50, 5.0)}, holds={"power": "zero"}, period_s=PERIOD_S)
    one, two = (fixed.predict(stimulus, values_of(fixed), refine=k).outputs["reading"] for k in (1, 2))
    assert np.array_equal(one, two)
    assert np.isfinite(two).all()
    free = unit_of(folder)
    one, two = (
        free.predict(record("band-limited"), values_of(free), refine=k).outputs["place"] for k in (1, 2)
    )
    assert 0.0 < np.abs(one - two).max() < 1e-3 * np.ptp(one)


def test_two_channels_of_one_name_are_told(folder: Path, tmp_path: Path) -> None:
    shutil.copy(folder / "heater.so", tmp_path)
    twice = DESCRIPTION.replace('name="power"', 'name="a.b"').replace('name="reading"', 'name="a_b"')
    with zipfile.ZipFile(tmp_path / "heater.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", twice)
        archive.write(tmp_path / "heater.so", "binaries/linux64/heater.so")
    with pytest.raises(InputError, match="more than one input or output would be called a_b here"):
        read_unit(tmp_path / "heater.fmu")


def test_it_is_identified_and_its_file_names_the_unit_from_where_it_lies(
    folder: Path, tmp_path: Path
) -> None:
    data = write_heater_data(tmp_path, late_s=0.0)
    fit = rtctl.identify(data, model=folder / "heater.toml")
    for name, true in (("capacity", 22.0), ("loss", 0.45), ("sensor", 0.5)):
        one = fit.model.parameters[name]
        assert one.standard_error is not None
        assert abs(one.value - true) < 5.0 * one.standard_error + 0.01 * true
    (tmp_path / "deep").mkdir()
    written = fit.model.save(tmp_path / "deep" / "fitted.toml")
    assert f'file = "../../{folder.name}' in written.read_text() or "heater.fmu" in written.read_text()
    assert not Path(rtctl.read_model(written).content.model.file).is_relative_to(written.parent)
    again = rtctl.read_model(written)
    assert again.parameters["capacity"].value == fit.model.parameters["capacity"].value


def test_a_found_delay_is_named_with_what_it_cannot_be_told_from(folder: Path, tmp_path: Path) -> None:
    data = write_heater_data(tmp_path, late_s=0.6)
    own = ["input.power.delay", "output.reading.skew", "output.reading.offset", "input.power.saturation"]
    found = rtctl.diagnose(data, folder / "heater.toml", mechanisms=own)
    assert found.verdict == "explained"
    assert {one.id for one in found.causes} <= {"input.power.delay", "output.reading.skew"}


def test_files_of_somebody_are_taken_with_the_unit_itself(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_heater_data(tmp_path, late_s=0.0)
    (tmp_path / "dataset.toml").unlink()
    for k in range(3):
        rows = (tmp_path / f"r{k}.csv").read_text().replace("t,P,T", "time [s],power [W],reading [K]", 1)
        (tmp_path / f"r{k}.csv").write_text(rows)
    files = [str(tmp_path / f"r{k}.csv") for k in range(3)]
    unit = str(folder / "heater.fmu")
    assert (
        main(["init", *files, "--model", unit, "--hold", "zero", "--yes", "--out", str(tmp_path / "d")]) == 0
    )
    assert 'plant = "fmu"' in (tmp_path / "d" / "dataset.toml").read_text()
    model = tmp_path / "model.toml"
    assert (
        main(
            [
                "identify",
                str(tmp_path / "d" / "dataset.toml"),
                "--model",
                unit,
                "--out",
                str(model),
                "--quiet",
            ]
        )
        == 0
    )
    assert {"capacity", "loss", "coupling", "sensor", "room"} == set(rtctl.read_model(model).parameters)
    capsys.readouterr()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            MODEL.replace("capacity =", "capcity ="),
            'no parameter "capcity" that is a real number; did you mean "capacity"',
        ),
        (MODEL.replace("heater.fmu", "heter.fmu"), "there is no such file"),
        (
            MODEL.replace('unit = "J/K", low = 1', 'unit = "V", low = 1'),
            "capacity is in V, which is not compatible with",
        ),
        (
            MODEL + '[model.states]\nplate = { start = "room", variable = "plat", unit = "K" }\n',
            'no variable "plat"',
        ),
    ],
)
def test_what_is_wrong_in_a_file_is_named(folder: Path, text: str, told: str) -> None:
    path = folder / "wrong.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=told):
        fmu_simulation(read_fmu_model(path), {"power": "W", "reading": "K"}, str(path))


def test_units_in_modelica_s_notation_are_read(folder: Path) -> None:
    unit = read_unit(folder / "heater.fmu")
    variable = next(one for one in unit.description.modelVariables if one.name == "capacity")
    assert variable.unit == "J.K-1"
    assert unit_text(variable, unit.description) == "J/K"
    written = {
        "m/s2": "m/s^2",
        "kg.m2": "kg*m^2",
        "W/(m2.K)": "W/(m^2*K)",
        "s-1": "1/s",
        "N.m.A-1": "N*m/A",
        "Pa.s": "Pa.s",
    }
    for modelica, text in written.items():
        assert unit_text(SimpleNamespace(unit=modelica, declaredType=None), unit.description) == text


def test_names_that_no_signal_may_have_are_written_otherwise(folder: Path, tmp_path: Path) -> None:
    shutil.copy(folder / "heater.so", tmp_path)
    dotted = DESCRIPTION.replace('name="power"', 'name="bus.u[1]"').replace('name="loss"', 'name="wall.G"')
    with zipfile.ZipFile(tmp_path / "heater.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", dotted)
        archive.write(tmp_path / "heater.so", "binaries/linux64/heater.so")
    model = rtctl.read_model(tmp_path / "heater.fmu")
    again = rtctl.read_model(model.save(tmp_path / "model.toml"))
    assert "wall.G" in again.parameters
    unit = fmu_simulation(again.content, {"bus_u_1": "W", "reading": "K"}, "heater")
    assert {"input.bus_u_1.delay", "output.reading.lag"} <= set(unit.catalogue)


def test_a_model_file_is_served_with_its_values(folder: Path) -> None:
    path = folder / "fitted.toml"
    path.write_text(MODEL.replace("value = 0.5", "value = 250.0").replace("W/K", "mW/K"), encoding="utf-8")
    slow, fast = load_plant(path), load_plant(folder / "heater.toml")
    for device in (slow, fast):
        for _ in range(400):
            device.advance([20.0], 1.0)
    assert slow.measure()[1] - 295.0 == pytest.approx(2.0 * (fast.measure()[1] - 295.0), rel=0.02)
    path.write_text(MODEL + '[[model.mechanisms]]\nid = "output.reading.lag"\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"has no mechanisms beside it, such as output\.reading\.lag"):
        load_plant(path)


def test_units_whose_zero_lies_elsewhere_are_taken_as_they_are_or_refused(
    folder: Path, tmp_path: Path
) -> None:
    shutil.copy(folder / "heater.so", tmp_path)
    celsius = DESCRIPTION.replace('<Real unit="K"/>', '<Real unit="degC"/>')
    with zipfile.ZipFile(tmp_path / "heater.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", celsius)
        archive.write(tmp_path / "heater.so", "binaries/linux64/heater.so")
    model = read_fmu_model(tmp_path / "heater.fmu")
    unit = fmu_simulation(model, {"power": "W", "reading": "degC"}, "heater")
    stimulus = Stimulus(inputs={"power": np.zeros(5)}, holds={"power": "zero"}, period_s=PERIOD_S)
    assert unit.predict(stimulus, values_of(unit)).outputs["reading"][0, 0] == 295.0
    with pytest.raises(InputError, match=r"heater: .*zero elsewhere; take K"):
        fmu_simulation(model, {"power": "W", "reading": "K"}, "heater")
