"""Exported loops of models with mechanisms against the loop in Python, to the bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from vo2_model_cases import simulation

from rtctl.api.exporting.c import export_c, replay_export
from rtctl.api.runs.running import run
from rtctl.export.c.laws.planning import law_of
from rtctl.export.c.proof.comparison import differences, prove
from rtctl.export.c.proof.corners import corner_rows
from rtctl.export.c.proof.in_python import PythonLaw
from rtctl.export.c.proof.machines import MACHINES, REALS, build
from rtctl.export.c.proof.machines import run as run_on
from rtctl.export.c.translated import translated
from rtctl.models.vo2 import read_model, write_model
from rtctl.scenario.bundled import find_scenario
from rtctl.scenario.schema import load_scenario

SENSOR: dict[str, Any] = {
    "sensor__lag": {"time_constant": 2e-3}, "sensor__ageing": {"rate": 0.5}, "sensor__crosstalk": {"leak": 900.0},
}  # fmt: skip
HEAT: dict[str, Any] = {
    "thermal__second_time_constant": {"share": 0.3, "time_constant": 9e-3},
    "thermal__latent_heat": {"heat": 6.0},
    "thermal__ambient_drift": {"rate": 60.0, "settling_time": 0.06},
    "sensor__self_heating": {"heat": 4.0},
    "actuation__delay": {"delay": 2.3e-3},
}
LATE: dict[str, Any] = {
    "hysteresis__rate_dependence": {
        "time_constant": 3e-3, "activation": 0.03, "expansion": 0.4, "mixing": 0.3,
    },
    "structure__resonance": {"participation": 1.0, "frequency": 90.0, "damping_ratio": 0.05},
    "actuation__deadband": {"width": 0.1},
}  # fmt: skip
SETTINGS = {"scenario.any_device": True, "scenario.duration": "0.15 s", "controller.feedforward": "inverse"}
CASES = {
    "heat": (HEAT, "observer"),
    "late": (LATE, "observer"),
    "sensor": (SENSOR, "observer"),
    "corrected": (SENSOR, "composite"),
}


def written(folder: Path, mechanisms: dict[str, Any]) -> Path:
    """The file of a small model with mechanisms."""
    path = folder / "model.toml"
    write_model(simulation(**mechanisms).model, path)
    return path


@pytest.mark.parametrize("case", CASES)
def test_a_recorded_run_is_computed_to_the_bit(tmp_path: Path, case: str) -> None:
    mechanisms, estimator = CASES[case]
    model, settings = written(tmp_path, mechanisms), {**SETTINGS, "estimator.kind": estimator}
    run("steps", model=model, settings=settings, out=tmp_path / "run")
    export_c("steps", model=model, settings=settings, out=tmp_path / "loop", extrema=256)
    proof = prove(tmp_path / "loop", tmp_path / "run", ["gcc"])
    assert [(one.machine, one.precision, one.first) for one in proof.computed] == [
        ("this computer, gcc", "float", ""),
        ("the recorded loop", "double", ""),
        ("this computer, gcc", "double", ""),
    ]


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_every_machine_that_is_here_computes_the_same(tmp_path: Path, case: str) -> None:
    mechanisms, estimator = CASES[case]
    model, settings = written(tmp_path, mechanisms), {**SETTINGS, "estimator.kind": estimator}
    run("steps", model=model, settings=settings, out=tmp_path / "run")
    export_c("steps", model=model, settings=settings, out=tmp_path / "loop", extrema=256)
    computed = [one for one in replay_export(tmp_path / "run", tmp_path / "loop").computed if not one.skipped]
    assert [one.first for one in computed] == [""] * len(computed)


@pytest.mark.parametrize("precision", ["float", "double"])
def test_corners_are_computed_to_the_bit(tmp_path: Path, precision: str) -> None:
    model, settings = written(tmp_path, {**HEAT, **SENSOR}), ["controller.feedforward=inverse"]
    export_c("steps", model=model, settings=settings, out=tmp_path / "loop")
    scenario, _ = load_scenario(find_scenario("steps"), settings)
    exported = translated(law_of(scenario, read_model(model)))
    rows = corner_rows(exported.law, 1200, REALS[precision], seed=2)
    oracle = PythonLaw(*exported, REALS[precision])(rows)
    assert {0, 1} <= set(np.unique(oracle["fault"]).tolist())
    machine = MACHINES["gcc"]
    found = run_on(build(tmp_path / "loop", machine, precision), machine, rows, oracle.dtype)
    assert differences(found, oracle) == (0, "")


@pytest.mark.parametrize("mechanism", ["sensor__lag", "thermal__latent_heat"])
def test_single_precision_stays_close_to_the_recorded_loop(tmp_path: Path, mechanism: str) -> None:
    """Where a slope is told from two numbers that may differ by rounding alone."""
    model = written(tmp_path, {mechanism: {**SENSOR, **HEAT}[mechanism]})
    settings = {**SETTINGS, "controller.feedforward": "none"}
    run("steps", model=model, settings=settings, out=tmp_path / "run")
    export_c("steps", model=model, settings=settings, out=tmp_path / "loop")
    proof = prove(tmp_path / "loop", tmp_path / "run", [])
    assert proof.deviations["estimate"]["max_percent"] < 0.02
