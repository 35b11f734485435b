"""Devices with an effect, run with the nominal model and with the extended one: the error falls, and the run says so.

The long version, with the diagnosis between the two runs, is benchmarks/closed_loop_gain.py.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from wire_cases import settings, summary_of

from plant_sim.catalogue import bundled_plant
from rtctl.cli import main

ROOT = Path(__file__).resolve().parents[2]
VO2 = {
    "actuation.delay": ('delay = "3 ms"', 'delay = { value = 3, unit = "ms" }', 5.0),
    "sensor.lag": ('sensor_lag = "4 ms"', 'time_constant = { value = 4, unit = "ms" }', 10.0),
    "thermal.second_time_constant": (
        'second_share = 0.35\nsecond_time_constant = "6 ms"',
        'share = { value = 0.35, unit = "dimensionless" }, time_constant = { value = 6, unit = "ms" }',
        5.0,
    ),
}
ME = {
    "drive.delay": ('delay = { value = 20, unit = "us" }', 1.5),
    "sensor.saturation": ('curvature = { value = 0.5, unit = "1/um^2" }', 1.5),
    "sensor.lag": ('time_constant = { value = 10, unit = "us" }', 1.5),
}


@pytest.fixture(autouse=True)
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rtctl.session.run_files.draw_run", lambda path, scenario, result: None)


def extension(identity: str, parameters: str) -> str:
    return f'\n[[model.mechanisms]]\nid = "{identity}"\nparameters = {{ {parameters} }}\n'


def errors(scenario: str, models: dict[str, Path], out: Path, *overrides: str) -> dict[str, float]:
    """Mean tracking error [um] with each model."""
    found = {}
    for name, model in models.items():
        command = ["run", scenario, "--model", str(model), "--out", str(out / name), "--no-plot"]
        assert main([*command, *settings(*overrides)]) in (0, 1)
        found[name] = summary_of(out / name)["tracking"]["mean_abs_um"]
    return found


@pytest.mark.parametrize("identity", VO2)
def test_a_vo2_device_with_an_effect_is_tracked_when_the_model_has_it(
    identity: str, model_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hidden, parameters, times = VO2[identity]
    device = tmp_path / "device.toml"
    device.write_text(bundled_plant("vo2_a").read_text() + f"\n[effects]\n{hidden}\n")
    extended = tmp_path / "extended.toml"
    extended.write_text(model_file.read_text() + extension(identity, parameters))
    found = errors(
        "multisine_1_10hz", {"before": model_file, "after": extended}, tmp_path,
        f'driver.device="{device}"', "scenario.duration=1 s",
    )  # fmt: skip
    assert found["after"] < found["before"] / times
    assert found["after"] < 0.5, "um; the device without the effect has 0.3 of 57, the approach included"
    printed = capsys.readouterr()
    assert f"the loop uses {identity}" in printed.out + printed.err


@pytest.mark.parametrize("identity", ME)
def test_a_resonator_with_an_effect_holds_its_amplitude_when_the_model_has_it(
    identity: str, tmp_path: Path
) -> None:
    parameters, times = ME[identity]
    nominal = (ROOT / "scenarios" / "models" / "me_a.toml").read_text().partition("[provenance]")[0]
    instruments = '\n[device.drive]\nunit = "mA"\n[device.displacement]\nunit = "um"\n'
    for name, text in {"nominal": nominal, "extended": nominal + extension(identity, parameters)}.items():
        (tmp_path / f"{name}.toml").write_text(text)
    (tmp_path / "beam.toml").write_text(nominal + extension(identity, parameters) + instruments)
    bundled = bundled_plant("me_a").read_text()
    lock_in = bundled[bundled.index("[lock_in]") :]
    (tmp_path / "bench.toml").write_text(
        '[plant]\nkind = "me"\nname = "ME-T"\nmodel = "beam.toml"\n[coil]\ncurrent_high = "400 mA"\n'
        f'frequency_low = "6.5 kHz"\nfrequency_high = "8.5 kHz"\nfrequency_rest = "7.5 kHz"\n{lock_in}'
    )
    models = {"before": tmp_path / "nominal.toml", "after": tmp_path / "extended.toml"}
    device = f'driver.device="{tmp_path / "bench.toml"}"'
    found = errors("me_amplitude", models, tmp_path, device, "scenario.duration=0.8 s")
    assert found["after"] < found["before"] / times
    held = {check["check"]: check["measured"] for check in summary_of(tmp_path / "after")["checks"]}
    assert held["hold_max_percent"] < 0.2
