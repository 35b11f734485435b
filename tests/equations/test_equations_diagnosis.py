"""`rtctl diagnose` on a user's equations: hidden effects are named, nothing is where nothing is, mistakes are said."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hidden.case import judge, write_case
from hidden.effects import effects
from hidden.systems import DEVELOPED_ON, SYSTEMS

import rtctl
from rtctl.cli import main

FEW = "input.u.delay,output.y.offset,state.x1.limit,state.x2.friction,parameter.k3.drift"


@pytest.mark.slow
def test_an_effect_is_named_in_the_models_words_and_written_into_its_equations(tmp_path: Path) -> None:
    manifest = write_case(tmp_path / "data", "circuit", "input.source.dead_band", 3, samples=300)
    out, model = tmp_path / "out", SYSTEMS["circuit"].path
    assert main(["diagnose", str(manifest), "--model", str(model), "--out", str(out), "--quiet"]) == 0
    answer = json.loads((out / "diagnosis.json").read_text())
    assert answer["verdict"] == "explained"
    (cause,) = answer["causes"]
    assert cause["id"] == "input.source.dead_band"
    assert cause["indistinguishable_from"] == []
    assert "of the input source [V], of either sign, do nothing" in cause["statement"]
    extended = rtctl.read_model(out / "model-extended.toml")
    assert "source_acting" in extended.content.model.states["flux"].rate
    assert answer["gain"]["after"] < 1.3 * answer["gain"]["noise_floor"]
    scores = rtctl.simulate(extended, rtctl.read_dataset(manifest)).scores
    before = rtctl.simulate(model, rtctl.read_dataset(manifest)).scores
    assert scores[-1].rms_error < 0.3 * before[-1].rms_error


@pytest.mark.slow
def test_nothing_hidden_is_adequate_and_a_parameter_that_no_data_tell_is_held(tmp_path: Path) -> None:
    manifest = write_case(tmp_path / "data", "tanks", "", 5, samples=250)
    answer = rtctl.diagnose(manifest, SYSTEMS["tanks"].path, mechanisms=FEW)
    assert (answer.verdict, answer.causes) == ("adequate", ())
    (held,) = [one for one in answer.warnings if "cannot tell" in one]
    assert "stays at 0.05" in held


def test_an_id_that_the_model_has_not_is_said_with_the_nearest(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest = write_case(tmp_path / "data", "tanks", "", 5, samples=60)
    command = [
        "diagnose",
        str(manifest),
        "--model",
        str(SYSTEMS["tanks"].path),
        "--out",
        str(tmp_path / "out"),
    ]
    assert main([*command, "--mechanisms", "state.x3.limit"]) == 2
    assert 'there is no mechanism "state.x3.limit"; did you mean "state.x2.limit"' in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("system", DEVELOPED_ON)
@pytest.mark.parametrize("place", range(0, 16, 3))
def test_further_effects_are_named(system: str, place: int, tmp_path: Path) -> None:
    effect = list(effects(SYSTEMS[system]))[place]
    manifest = write_case(tmp_path / "data", system, effect, 11 + place)
    answer = rtctl.diagnose(manifest, SYSTEMS[system].path)
    assert judge(system, effect, answer.to_dict(), 0.0).outcome.startswith("right")
    assert answer.gain is not None
    assert np.isfinite(answer.gain.ratio)
