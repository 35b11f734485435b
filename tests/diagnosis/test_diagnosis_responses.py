"""Records of a velocity or an acceleration alone: identified, simulated and diagnosed by the commands."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import FRICTION, MODEL, PERIOD_S, device, json_of, noise_drive

from rtctl.border.simulation import Simulation, Stimulus
from rtctl.border.units.quantities import convert
from rtctl.cli import main

UNITS = {"velocity": ("mm/s", 1.0), "acceleration": ("m/s^2", 1e-3)}
NOISE = 0.01


# 6 parameters because that is what records differ by
def write(
    folder: Path,
    plant: Simulation,
    response: str,
    hold: str,
    offset: float = 0.0,
    *,
    after_jump: bool = False,
    zeroed_anew: bool = False,
) -> Path:
    """Three records at rest, the last one a test; `offset` over the first response's RMS, or over each."""
    unit, factor = UNITS[response]
    text = '[dataset]\nname = "bench"\nplant = "oscillator"\n'
    text += f'[signals.drive]\nrole = "input"\nunit = "V"\nhold = "{hold}"\n'
    text += f'[signals.{response}]\nrole = "output"\nunit = "{unit}"\ncolumn = "reading"\n'
    values = np.array([parameter.value for parameter in plant.parameters])
    plant, size = replace(plant, outputs=("displacement", "velocity", "acceleration")), 0.0
    for seed, use in ((1, "fit"), (2, "fit"), (3, "test")):
        drive = noise_drive(seed, 9.0)
        run = plant.predict(
            Stimulus(
                inputs={"drive": drive},
                holds={"drive": hold},
                period_s=PERIOD_S,
                after_jumps=frozenset({"acceleration"}) if after_jump else frozenset(),
            ),
            values,
        )
        reading = factor * run.outputs[response][0]
        noise = np.random.default_rng(seed + 100).standard_normal(len(drive))
        size = reading.std() if seed == 1 or zeroed_anew else size
        reading = reading + NOISE * reading.std() * noise + offset * size
        np.savetxt(
            folder / f"r{seed}.csv", np.column_stack((drive, reading)), delimiter=",", header="drive,reading",
            comments="",
        )  # fmt: skip
        text += f'[[records]]\nfile = "r{seed}.csv"\nsample_rate_hz = {1 / PERIOD_S}\nuse = "{use}"\n'
    (folder / "dataset.toml").write_text(text)
    return folder / "dataset.toml"


@pytest.mark.slow
@pytest.mark.parametrize("hold", ["zero", "linear"])
@pytest.mark.parametrize("response", ["velocity", "acceleration"])
def test_friction_is_found_by_any_response(tmp_path: Path, response: str, hold: str) -> None:
    manifest, model = write(tmp_path, device(FRICTION), response, hold), tmp_path / "model.toml"
    assert main(["identify", str(manifest), "--out", str(model), "--quiet", "--no-plot"]) == 0
    ids = "friction.coulomb,damping.quadratic,stiffness.cubic,sensor.offset"
    found = json_of(manifest, model, ids)
    (cause,) = found["causes"]
    assert cause["id"] == "friction.coulomb"
    level = cause["parameters"]["level"]
    assert convert(level["value"], level["unit"], "mm/s^2") == pytest.approx(450.0, rel=0.02)
    assert found["gain"]["before"] > 5.0 * found["gain"]["after"]
    for name in ("velocity", "acceleration"):
        assert any(f"the diagnosis used the {name} alone" in one for one in found["warnings"]) == (
            name == response
        )


@pytest.mark.parametrize("after_jump", [False, True], ids=["before", "after"])
def test_an_acceleration_on_either_side_of_a_jump_is_no_effect(tmp_path: Path, after_jump: bool) -> None:
    """Most simulations write that after it, `f(x, u[k])`; it was told as a skew and a lag."""
    manifest = write(tmp_path, device(), "acceleration", "zero", after_jump=after_jump)
    model = tmp_path / "model.toml"
    assert main(["identify", str(manifest), "--out", str(model), "--quiet", "--no-plot"]) == 0
    found = json_of(manifest, model, "timing.skew,sensor.lag,drive.lag,stiffness.viscoelastic")
    assert found["verdict"] == "adequate"
    said = [one for one in found["warnings"] if "read just after the jumps of drive" in one]
    assert len(said) == int(after_jump)


@pytest.mark.slow
@pytest.mark.parametrize("response", ["velocity", "acceleration"])
def test_a_stop_is_found_where_the_motion_passes_also_by_its_velocity_or_acceleration(
    tmp_path: Path, response: str
) -> None:
    """Places are tried by the displacement, of which these tell the size alone."""
    parameters = {"above": {"value": 3e4, "unit": "1/s^2"}, "place": {"value": 0.5, "unit": "mm"}}
    stop = {"id": "stop.one_sided", "parameters": parameters}
    manifest = write(tmp_path, device(stop), response, "linear")
    (tmp_path / "model.toml").write_text(MODEL)
    ids = "stop.one_sided,stiffness.cubic,stiffness.quadratic"
    found = json_of(manifest, tmp_path / "model.toml", ids)
    (cause,) = found["causes"]
    assert cause["id"] == "stop.one_sided"
    place = cause["parameters"]["place"]
    assert convert(place["value"], place["unit"], "mm") == pytest.approx(0.5, rel=0.01)


@pytest.mark.slow
def test_an_accelerometer_that_reads_gravity_too_has_an_offset_in_its_own_unit(tmp_path: Path) -> None:
    manifest, model = write(tmp_path, device(), "acceleration", "linear", offset=0.4), tmp_path / "model.toml"
    assert main(["identify", str(manifest), "--out", str(model), "--quiet", "--no-plot"]) == 0
    ids = "sensor.offset,sensor.lag,sensor.saturation,drive.offset,stiffness.quadratic"
    command = ["diagnose", str(manifest), "--model", str(model), "--mechanisms", ids, "--quiet"]
    assert main([*command, "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    (cause,) = found["causes"]
    assert cause["id"] == "sensor.offset"
    offset = cause["parameters"]["offset"]
    assert offset["unit"] == "m/s^2"
    assert convert(offset["value"], offset["unit"], "mm/s^2") > 0.0
    assert (
        main(
            [
                "simulate",
                str(tmp_path / "out" / "model-extended.toml"),
                str(manifest),
                "--out",
                str(tmp_path / "s"),
            ]
        )
        == 0
    )


def test_a_zero_of_its_own_in_each_record_is_told_and_is_no_noise(tmp_path: Path) -> None:
    """Slow noise holds the constants of the fitted records; "nothing is wrong" was said of it, at 8 times the noise."""
    manifest = write(tmp_path, device(), "acceleration", "linear", offset=0.4, zeroed_anew=True)
    model = tmp_path / "model.toml"
    assert main(["identify", str(manifest), "--out", str(model), "--quiet", "--no-plot"]) == 0
    found = json_of(manifest, model, "sensor.offset,sensor.lag,drive.offset")
    assert found["verdict"] != "adequate"
    (said,) = [one for one in found["warnings"] if "take each record's own zero off its readings" in one]
    assert "r3: reads +6" in said


def test_a_dataset_without_any_response_is_refused_with_what_is_needed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "r.csv").write_text("drive\n" + "1.0\n" * 20)
    (tmp_path / "dataset.toml").write_text(
        '[dataset]\nname = "b"\nplant = "oscillator"\n[signals.drive]\nrole = "input"\nunit = "V"\n'
        '[[records]]\nfile = "r.csv"\nsample_rate_hz = 100.0\n'
    )
    assert main(["identify", str(tmp_path / "dataset.toml"), "--out", str(tmp_path / "m.toml")]) == 2
    said = capsys.readouterr().err
    assert "needs one of displacement, velocity, acceleration" in said
    assert len(said.strip().splitlines()) == 1
