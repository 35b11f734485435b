"""A VO2 model's unit computes what `rtctl simulate` computes, with each mechanism, within rounding."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from export.fmu_cases import free_runs
from vo2_model_cases import small_model, telegraph

import rtctl
from rtctl import Record
from rtctl.border.model_file import MechanismTable, Value
from rtctl.models.vo2 import save_model
from rtctl.simulations.vo2.mechanisms import MECHANISMS

pytest.importorskip("fmpy")
ROUNDING = 1e-11
"""In parts of the range."""
SAMPLES = 600
PERIOD_S = 1e-3
UNITS = {"current": "mA", "resistance": "ohm", "deflection": "um"}
CASES: dict[str, dict[str, float]] = {
    "nothing": {},
    "thermal.second_time_constant": {"share": 0.3, "time_constant": 0.02},
    "thermal.nonlinear_loss": {"loss": 0.004},
    "thermal.nonlinear_loss unknown": {"loss": 0.004, "known": 0.3},
    "thermal.latent_heat": {"heat": 20.0, "film": 0.4},
    "thermal.ambient_drift": {"rate": 20.0, "settling_time": 0.3, "activation": 1e-3, "expansion": 1e-2},
    "heater.tcr": {"tcr": 0.002, "known": 0.5},
    "thermal.phase_heating": {"growth": 0.3, "known": 0.5},
    "sensor.self_heating": {"heat": 8.0, "known": 0.5},
    "actuation.delay": {"delay": 3.4e-3},
    "actuation.delay whole": {"delay": 4e-3},
    "actuation.deadband": {"width": 0.4, "behind": 0.8},
    "actuation.deadband zone": {"zone": 0.7},
    "actuation.deadband held": {"held": 0.9, "hold": 0.3},
    "structure.resonance": {"participation": 1.0, "frequency": 40.0, "damping_ratio": 0.05},
    "hysteresis.rate_dependence": {"time_constant": 3e-3, "activation": 2e-3, "expansion": 3e-2, "mixing": 0.3},
    "hysteresis.creep": {"rate": 0.05, "onset": 2e-3, "end": 0.3, "activation": 1e-3, "mixing": -0.4},
    "hysteresis.shape": {"resistance_first": 0.2, "resistance_side": 0.1, "deflection_side_second": 2.0},
    "sensor.lag": {"time_constant": 3e-3},
    "sensor.deflection_lag": {"time_constant": 3e-3},
    "sensor.highpass": {"rate": 8.0, "settled": 0.4},
    "sensor.crosstalk": {"leak": 30.0, "known": 0.6},
    "sensor.ageing": {"rate": 0.1, "slowing_time": 0.05},
    "sensor.drift": {"rate": 3.0, "settling_time": 0.2},
    "sensor.quantisation": {"resistance": 20.0, "deflection": 0.05},
    "input.gain_drift": {"rate": 0.05, "settling_time": 0.1},
}  # fmt: skip
"""Parameters of each mechanism that has a form in C; a word after the id tells cases apart."""
QUICK = {"nothing", "actuation.delay", "hysteresis.creep"}


def vo2(folder: Path, *cases: str) -> Path:
    """Write an identified model with some mechanisms, and return its file."""
    tables = []
    for case in cases:
        mechanism = MECHANISMS[case.split()[0]]
        units = {one.name: one.unit for one in mechanism.parameters}
        values = {name: Value(value=value, unit=units[name]) for name, value in CASES[case].items()}
        tables.append(MechanismTable(id=mechanism.id, parameters=values))
    path = folder / "vo2.toml"
    save_model(path, dataclasses.replace(small_model(), mechanisms=tuple(tables)))
    return path


def recorded(folder: Path, hold: str) -> rtctl.Dataset:
    """Return a record of a random current."""
    current = telegraph(SAMPLES)
    signals = {
        "current": current,
        "resistance": np.full(current.size, 1e4),
        "deflection": np.zeros(current.size),
    }
    record = Record(name="a", period_s=PERIOD_S, use="test", signals=signals)
    return rtctl.write_dataset(
        folder / "data", [record], name="x", plant="vo2", units=UNITS, holds={"current": hold}
    )


@pytest.mark.parametrize("hold", ["zero", "linear"])
@pytest.mark.parametrize(
    "case", [pytest.param(one, marks=() if one in QUICK else pytest.mark.slow) for one in CASES]
)
def test_each_mechanism_in_a_unit_is_as_in_its_simulation(case: str, hold: str, tmp_path: Path) -> None:
    model = vo2(tmp_path, *([] if case == "nothing" else [case]))
    data = recorded(tmp_path, hold)
    errors = free_runs(model, data, tmp_path)
    assert max(errors.values()) < ROUNDING, errors
    if case != "nothing":
        (tmp_path / "plain").mkdir()
        nominal, own = (
            rtctl.simulate(one, data).records["a"].simulated for one in (vo2(tmp_path / "plain"), model)
        )
        assert max(np.ptp(own[name] - nominal[name]) / np.ptp(nominal[name]) for name in nominal) > 1e-4


@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_mechanisms_act_together_in_the_order_of_the_simulation(hold: str, tmp_path: Path) -> None:
    together = (
        "actuation.delay", "actuation.deadband zone", "input.gain_drift", "thermal.second_time_constant",
        "thermal.latent_heat", "hysteresis.rate_dependence", "hysteresis.creep", "hysteresis.shape",
        "structure.resonance", "sensor.ageing", "sensor.crosstalk", "sensor.lag", "sensor.deflection_lag",
        "sensor.highpass", "sensor.drift",
    )  # fmt: skip
    errors = free_runs(vo2(tmp_path, *together), recorded(tmp_path, hold), tmp_path)
    assert max(errors.values()) < ROUNDING, errors


def test_a_state_that_is_restored_goes_on_as_before(tmp_path: Path) -> None:
    from fmpy import extract, read_model_description
    from fmpy.fmi3 import FMU3Slave

    model = vo2(tmp_path, "actuation.delay", "hysteresis.creep", "sensor.lag")
    unit = rtctl.export_fmu(model, tmp_path / "unit.fmu", step_s=PERIOD_S)
    told = read_model_description(str(unit.path))
    reference = {one.name: one.valueReference for one in told.modelVariables}
    ran = FMU3Slave(
        guid=told.guid, unzipDirectory=extract(str(unit.path)), instanceName="a",
        modelIdentifier=told.coSimulation.modelIdentifier,
    )  # fmt: skip
    ran.instantiate()
    ran.enterInitializationMode()
    ran.exitInitializationMode()
    current = telegraph(60)

    def run(begin: int, end: int) -> list[list[float]]:
        found = []
        for k in range(begin, end):
            ran.setFloat64([reference["current"]], [float(current[k])])
            ran.doStep(k * PERIOD_S, PERIOD_S)
            found.append(ran.getFloat64([reference[name] for name in ("resistance", "deflection")]))
        return found

    run(0, 30)
    copy = ran.getFMUState()
    went_on = run(30, 60)
    ran.setFMUState(copy)
    assert run(30, 60) == went_on
    ran.freeFMUState(copy)
    ran.terminate()
    ran.freeInstance()


def test_a_delay_of_more_steps_than_are_kept_is_told(tmp_path: Path) -> None:
    import fmpy

    unit = rtctl.export_fmu(vo2(tmp_path, "actuation.delay"), tmp_path / "unit.fmu", step_s=PERIOD_S)
    told: list[str] = []
    with pytest.raises(Exception, match="fmi3DoStep"):
        fmpy.simulate_fmu(
            str(unit.path), stop_time=0.1, output_interval=1e-4, start_values={"actuation.delay.delay": 0.05},
            logger=lambda *words: told.append(str(words[-1])), debug_logging=True,
        )  # fmt: skip
    assert any("more communication steps than the unit keeps (256)" in one for one in told), told
    long = {"actuation.delay.delay": 0.05}
    fmpy.simulate_fmu(str(unit.path), stop_time=0.3, output_interval=PERIOD_S, start_values=long)


def test_readings_at_another_instant_have_no_form_and_it_says_why(tmp_path: Path) -> None:
    skew = MechanismTable(id="timing.skew", parameters={"late": Value(value=1.0, unit="ms")})
    path = tmp_path / "vo2.toml"
    save_model(path, dataclasses.replace(small_model(), mechanisms=(skew,)))
    with pytest.raises(
        rtctl.InputError, match=r"timing\.skew has no form in C: .* a matter of the recording"
    ):
        rtctl.export_fmu(path, tmp_path / "unit.fmu")
