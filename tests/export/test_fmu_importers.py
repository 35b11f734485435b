"""Units in importers that know nothing of us, besides FMPy: fmuloader for FMI 3.0, libcosim (FMI Library) for 2.0."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from export.fmu_cases import oscillator
from export.test_fmu_signals import with_mechanisms
from export.test_fmu_vo2 import vo2

import rtctl

fmpy = pytest.importorskip("fmpy")
STEPS = 120
STEP_S = 2e-3


def driven(kind: str) -> tuple[str, np.ndarray, list[str]]:
    """Return the input of a kind of plant, its levels, one a step, and the outputs."""
    course = np.sin(0.15 * np.arange(STEPS))
    if kind == "vo2":
        return "current", 6.1 + 2.3 * course, ["resistance", "deflection"]
    return "drive", course, ["displacement"]


def in_fmpy(unit: Path, kind: str) -> np.ndarray:
    """Return the outputs (steps, outputs) at the ends of the steps."""
    name, levels, outputs = driven(kind)
    t = STEP_S * np.arange(STEPS)
    inputs = np.array(list(zip(t, levels, strict=True)), dtype=[("time", "f8"), (name, "f8")])
    ran = fmpy.simulate_fmu(
        str(unit),
        stop_time=STEP_S * STEPS,
        step_size=STEP_S,
        output_interval=STEP_S,
        input=inputs,
        output=outputs,
    )
    return np.column_stack([ran[one] for one in outputs])[1:]


def written(folder: Path, kind: str) -> Path:
    """Return a unit of FMI 3.0 with mechanisms that remember."""
    model = {
        "equations": lambda: with_mechanisms(folder, "input.drive.delay", "output.displacement.lag"),
        "oscillator": lambda: oscillator(folder, "drive.delay", "hysteresis.bouc_wen", "sensor.lag"),
        "vo2": lambda: vo2(folder, "actuation.delay", "hysteresis.creep", "thermal.latent_heat"),
    }[kind]()
    return rtctl.export_fmu(model, folder / "unit.fmu", step_s=STEP_S).path


@pytest.mark.parametrize("kind", ["equations", "oscillator", "vo2"])
def test_fmuloader_computes_what_fmpy_does_and_goes_on_from_a_serialised_state(
    kind: str, tmp_path: Path
) -> None:
    fmi3 = pytest.importorskip("fmuloader.fmi3")
    unit = written(tmp_path, kind)
    told = fmpy.read_model_description(str(unit))
    reference = {one.name: one.valueReference for one in told.modelVariables}
    name, levels, outputs = driven(kind)
    ran = fmi3.Fmi3Slave(unit, model_identifier=told.coSimulation.modelIdentifier)
    ran.instantiate_co_simulation("a", instantiation_token=told.instantiationToken)
    ran.enter_initialization_mode(start_time=0.0)
    ran.set_float64([reference[name]], [float(levels[0])])
    ran.exit_initialization_mode()
    seen, kept = [], b""
    for k in range(STEPS):
        if k == STEPS // 2:
            state = ran.get_fmu_state()
            kept = ran.serialize_fmu_state(state)
            ran.free_fmu_state(state)
        seen.append(advanced(ran, reference, name, levels[k], outputs, k))
    expected = in_fmpy(unit, kind)
    np.testing.assert_allclose(seen, expected, rtol=0.0, atol=1e-13 * np.ptp(expected))
    assert (np.ptp(seen, axis=0) > 0.01).all()
    state = ran.deserialize_fmu_state(kept)
    ran.set_fmu_state(state)
    again = [advanced(ran, reference, name, levels[k], outputs, k) for k in range(STEPS // 2, STEPS)]
    assert again == seen[STEPS // 2 :]
    ran.free_fmu_state(state)
    ran.terminate()
    ran.free_instance()


# 6 parameters because an importer is driven by numbers alone
def advanced(
    ran: object, reference: dict[str, int], name: str, level: float, outputs: list[str], k: int
) -> list[float]:
    """Take a step under a level, and return the outputs at its end."""
    ran.set_float64([reference[name]], [float(level)])
    ran.do_step(k * STEP_S, STEP_S)
    return ran.get_float64([reference[one] for one in outputs])


def test_libcosim_computes_what_fmpy_does(tmp_path: Path) -> None:
    pytest.importorskip("libcosimpy")
    program = Path(__file__).with_name("cosim_program.py")
    unit = rtctl.export_fmu(
        oscillator(tmp_path, "sensor.lag"), tmp_path / "a.fmu", version="2.0", step_s=STEP_S
    ).path
    done = subprocess.run(
        [sys.executable, str(program), str(unit)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    line = next(line for line in done.stdout.splitlines() if line.startswith(("[0.", "[-")))
    np.testing.assert_allclose(json.loads(line), in_fmpy(unit, "oscillator")[:, 0], rtol=0.0, atol=1e-15)
