"""A mechanism of a user makes data, is simulated, and is the cause that a diagnosis names."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from rtctl.border.errors import InputError
from rtctl.border.mechanisms import Mechanism, Parameter
from rtctl.cli import main
from rtctl.registry import load_plugin, mechanisms_of, register
from rtctl.wiring_models import mechanism_ids

sys.path.insert(0, str(Path(__file__).parent.parent / "diagnosis"))
from diagnosis_cases import MODEL, device, measured, noise_drive, write_case

PLUGIN = Path(__file__).parent / "own_mechanism.py"
COEFFICIENT = 0.12
OWN = {"id": "sensor.quadratic", "parameters": {"coefficient": {"value": COEFFICIENT, "unit": "1/mm"}}}


def bent_case(folder: Path) -> Path:
    """Records of a device whose sensor bends."""
    load_plugin(PLUGIN)
    uses = ((1, 6.0, "fit"), (2, 9.0, "fit"), (3, 7.5, "test"))
    drives = [(noise_drive(seed, level), use) for seed, level, use in uses]
    return write_case(folder, [(drive, measured(device(OWN), drive), use) for drive, use in drives])


def test_an_own_mechanism_is_named_by_a_diagnosis(tmp_path: Path) -> None:
    manifest = bent_case(tmp_path)
    command = [
        "diagnose",
        str(manifest),
        "--model",
        str(tmp_path / "model.toml"),
        "--plugin",
        str(PLUGIN),
        "--quiet",
    ]
    chosen = "friction.coulomb,stiffness.cubic,sensor.quadratic"
    assert main([*command, "--mechanisms", chosen, "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert found["verdict"] == "explained"
    (cause,) = found["causes"]
    assert cause["id"] == "sensor.quadratic"
    assert cause["parameters"]["coefficient"]["value"] == pytest.approx(COEFFICIENT, rel=0.05)
    assert cause["statement"].startswith("The sensor adds 0.1")
    errors = {}
    for name in ("model.toml", "out/model-extended.toml"):
        simulated = [
            "simulate",
            str(tmp_path / name),
            str(manifest),
            "--out",
            str(tmp_path / "s"),
            "--no-plot",
        ]
        assert main([*simulated, "--plugin", str(PLUGIN), "--quiet"]) == 0
        (row,) = [
            row
            for row in json.loads((tmp_path / "s" / "summary.json").read_text())["records"]
            if row["use"] == "test"
        ]
        errors[name] = row["outputs"]["displacement"]["rms_error"]
    assert errors["out/model-extended.toml"] < 0.3 * errors["model.toml"]


def test_without_the_plugin_its_id_is_unknown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    manifest = write_case(tmp_path, [(noise_drive(1), measured(device(), noise_drive(1)), "fit")])
    own = 'id = "sensor.quadratic"\nparameters = { coefficient = { value = 0.1, unit = "1/mm" } }\n'
    (tmp_path / "model.toml").write_text(MODEL + f"[[model.mechanisms]]\n{own}")
    command = ["simulate", str(tmp_path / "model.toml"), str(manifest), "--out", str(tmp_path / "out")]
    assert main([*command, "--quiet"]) == 2
    assert 'id = "sensor.quadratic" is no mechanism of an oscillator' in capsys.readouterr().err


def test_a_mechanism_enters_the_catalogue_of_its_kind_alone(tmp_path: Path) -> None:
    before = {kind: mechanism_ids(kind) for kind in ("oscillator", "vo2")}
    load_plugin(PLUGIN)
    assert mechanism_ids("oscillator") == (*before["oscillator"], "sensor.quadratic")
    assert mechanism_ids("vo2") == before["vo2"]


def test_a_mechanism_of_vo2_enters_its_catalogue() -> None:
    from rtctl.simulations.vo2.mechanism import Vo2Mechanism

    own = Vo2Mechanism(id="sensor.own", statement="{a}", parameters=(parameter("a"),))
    register("mechanism", "sensor.own", own)
    assert mechanism_ids("vo2")[-1] == "sensor.own"
    assert mechanisms_of("vo2")["sensor.own"] is own
    assert "sensor.own" not in mechanism_ids("oscillator")


def parameter(name: str) -> Parameter:
    return Parameter(name=name, unit="dimensionless", meaning="", scale=lambda s: 1.0)


def test_a_mechanism_that_fits_no_kind_an_id_that_is_taken_and_another_name_are_refused() -> None:
    plain = Mechanism(id="a.b", statement="{a}", parameters=(parameter("a"),))
    with pytest.raises(
        InputError, match=r'mechanism "a.b": a Mechanism is of no kind of plant; say which by plants='
    ):
        register("mechanism", "a.b", plain)
    with pytest.raises(
        InputError, match=r'mechanism "a.b": a "oscillator" needs a OscillatorMechanism, got a Mechanism'
    ):
        register("mechanism", "a.b", plain, plants="oscillator")
    with pytest.raises(InputError, match=r'mechanism "a.b": a "me" has no catalogue of mechanisms'):
        register("mechanism", "a.b", plain, plants="me")
    with pytest.raises(InputError, match=r'mechanism "b.c": its id is "a.b"; register it by its id'):
        register("mechanism", "b.c", plain)
    taken = mechanisms_of("oscillator")["friction.coulomb"]
    with pytest.raises(
        InputError, match=r'mechanism "friction.coulomb": the id is taken by a mechanism of rtctl'
    ):
        register("mechanism", "friction.coulomb", taken)
    assert "a.b" not in mechanism_ids("oscillator")
