"""What acts on a signal outside of the equations is in a unit as it is in the simulation: delays, lags, instruments."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from export.fmu_cases import free_runs, oscillator, oscillator_data
from export.test_fmu_equals_simulate import MODELS, STIFF, equations_data
from export.test_fmu_limits import LAG

import rtctl

pytest.importorskip("fmpy")
ROUNDING = 1e-11
SLOPES = 2e-6
"""A reading behind a lag has its slopes along the motion, in `rtctl simulate` from the readings around."""
THROUGH = LAG.replace('value = "u"', 'value = "u - x"').replace("value = 1.0", "value = 20.0")
"""A reading that the input reaches at once, and a state slowly."""
OF_DRIVE: dict[str, str] = {
    "delay": 'delay = { value = 5.3, unit = "ms" }',
    "lag": 'time_constant = { value = 4.0, unit = "ms" }, settled = { value = 0.5, unit = "dimensionless" }',
    "offset": 'offset = { value = 0.3, unit = "V" }',
    "gain_drift": 'rate = { value = 0.2, unit = "1/s" }, settling_time = { value = 0.3, unit = "s" }',
    "saturation": 'curvature = { value = 2.0, unit = "1/V^2" }, clipped = { value = 0.5, unit = "dimensionless" }, '
    'limit = { value = 0.3, unit = "V" }',
    "dead_band": 'width = { value = 0.2, unit = "V" }',
    "backlash": 'width = { value = 0.1, unit = "V" }',
}
OF_DISPLACEMENT: dict[str, str] = {
    "lag": 'time_constant = { value = 3.0, unit = "ms" }',
    "highpass": 'rate = { value = 10.0, unit = "1/s" }',
    "offset": 'offset = { value = 0.01, unit = "mm" }',
    "saturation": 'curvature = { value = 30.0, unit = "1/mm^2" }',
    "hum": 'cosine = { value = 0.01, unit = "mm" }, frequency = { value = 50.0, unit = "Hz" }',
    "drift": 'rate = { value = 0.02, unit = "mm/s" }, settling_time = { value = 0.3, unit = "s" }',
}
ALL = [f"input.drive.{law}" for law in OF_DRIVE] + [f"output.displacement.{law}" for law in OF_DISPLACEMENT]
QUICK = {"input.drive.delay", "output.displacement.lag"}


def with_mechanisms(folder: Path, *identities: str) -> Path:
    """Write the oscillator in equations with some mechanisms of its signals."""
    text = (MODELS / "oscillator.toml").read_text()
    for one in identities:
        laws = OF_DRIVE if one.startswith("input") else OF_DISPLACEMENT
        text += f'\n[[model.mechanisms]]\nid = "{one}"\nparameters = {{ {laws[one.rpartition(".")[2]]} }}\n'
    path = folder / "model.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("hold", ["zero", "linear"])
@pytest.mark.parametrize(
    "one", [pytest.param(one, marks=() if one in QUICK else pytest.mark.slow) for one in ALL]
)
def test_a_mechanism_of_a_signal_of_equations_is_in_the_unit(one: str, hold: str, tmp_path: Path) -> None:
    data = equations_data(MODELS / "oscillator.toml", tmp_path, hold, 2e-3)
    model = with_mechanisms(tmp_path, one)
    own, plain = (
        rtctl.simulate(file, data).records["a"].simulated for file in (model, MODELS / "oscillator.toml")
    )
    assert np.abs(own["displacement"] - plain["displacement"]).max() > 1e-3 * np.ptp(plain["displacement"])
    remembers = one.startswith("output") and one.rpartition(".")[2] in ("lag", "highpass")
    errors = free_runs(model, data, tmp_path)
    assert errors["displacement"] < (SLOPES if remembers else ROUNDING), errors


def test_mechanisms_of_all_signals_act_together_in_their_order(tmp_path: Path) -> None:
    data = equations_data(MODELS / "oscillator.toml", tmp_path, "zero", 2e-3)
    together = [
        one for one in ALL if not one.startswith("output") or one.endswith(("saturation", "offset", "hum"))
    ]
    assert free_runs(with_mechanisms(tmp_path, *together), data, tmp_path)["displacement"] < ROUNDING
    assert free_runs(with_mechanisms(tmp_path, *ALL), data, tmp_path, "2.0")["displacement"] < SLOPES


@pytest.mark.parametrize(
    ("equations", "identity", "parameters", "period_s", "bound"),
    [
        # an output that the delayed input reaches directly, behind implicit steps
        (STIFF, "input.u.delay", 'delay = { value = 0.13, unit = "s" }', 0.1, ROUNDING),
        (None, "input.outdoor.delay", 'delay = { value = 70.0, unit = "s" }', 60.0, ROUNDING),  # and events
        (None, "output.temperature.saturation", 'curvature = { value = 0.5, unit = "1/K^2" }', 60.0, ROUNDING),
    ],
)  # fmt: skip
def test_they_act_beside_stiff_parts_events_and_temperatures(
    equations: str | None, identity: str, parameters: str, period_s: float, bound: float, tmp_path: Path
) -> None:
    text = equations or (MODELS / "thermostat.toml").read_text()
    bare, model = tmp_path / "thermostat.toml", tmp_path / "model.toml"
    bare.write_text(text)
    model.write_text(f'{text}\n[[model.mechanisms]]\nid = "{identity}"\nparameters = {{ {parameters} }}\n')
    data = equations_data(bare, tmp_path, "zero", period_s)
    errors = free_runs(model, data, tmp_path)
    assert max(errors.values()) < bound, errors


@pytest.mark.parametrize("law", ["lag", "highpass"])
@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_a_filter_behind_an_output_with_an_input_in_it_is_in_the_unit(
    law: str, hold: str, tmp_path: Path
) -> None:
    """It was off by 6 % of the range behind a held input: the output jumps where the input does."""
    laws = {
        "lag": 'time_constant = { value = 2.0, unit = "ms" }',
        "highpass": 'rate = { value = 30.0, unit = "1/s" }',
    }
    bare, model = tmp_path / "through.toml", tmp_path / "model.toml"
    bare.write_text(THROUGH)
    model.write_text(
        f'{THROUGH}\n[[model.mechanisms]]\nid = "output.direct.{law}"\nparameters = {{ {laws[law]} }}\n'
    )
    errors = free_runs(model, equations_data(bare, tmp_path, hold, 1e-3), tmp_path)
    assert errors["direct"] < SLOPES, errors


@pytest.mark.parametrize("case", ["drive.delay", "drive.delay whole"])
def test_a_held_drive_that_is_late_jumps_within_the_steps_of_an_oscillator(case: str, tmp_path: Path) -> None:
    data = oscillator_data(tmp_path, "zero")
    assert free_runs(oscillator(tmp_path, case), data, tmp_path)["displacement"] < ROUNDING


@pytest.mark.parametrize(
    ("identity", "parameters", "words"),
    [
        (
            "output.displacement.skew",
            'late = { value = 1.0, unit = "ms" }',
            "the reading of a row at another instant",
        ),
        (
            "input.drive.hold",
            'toward_linear = { value = 1.0, unit = "dimensionless" }',
            "the simulator says how",
        ),
    ],
)
def test_what_has_no_form_is_named_with_its_reason(
    identity: str, parameters: str, words: str, tmp_path: Path
) -> None:
    model = tmp_path / "model.toml"
    text = (MODELS / "oscillator.toml").read_text()
    model.write_text(f'{text}\n[[model.mechanisms]]\nid = "{identity}"\nparameters = {{ {parameters} }}\n')
    with pytest.raises(rtctl.InputError, match=f"{identity} has no form in C: {words}".replace(".", r"\.")):
        rtctl.export_fmu(model, tmp_path / "a.fmu")
