"""A hold that is wrong in the manifest is a mistake there: it comes first, and no model or experiment before it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from diagnosis_cases import device, measured, noise_drive, write_case

from rtctl.cli import main
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.result import Cause, correction_of

LATE = {"id": "drive.delay", "parameters": {"delay": {"value": 6.0, "unit": "ms"}}}
SENSOR = {"id": "sensor.lag", "parameters": {"time_constant": {"value": 12.0, "unit": "ms"}}}
HOLDS = ("toward_zero", "toward_linear", "toward_band_limited")
FIRST = 'write hold = "zero" in [signals.drive] of the manifest'


def answered(
    folder: Path, capsys: pytest.CaptureFixture[str], plant: object, hold: str, tried: str
) -> tuple[str, str]:
    """What `rtctl diagnose` prints of three records whose manifest has the default hold, and its page."""
    drives = [(noise_drive(1, 6.0), "fit"), (noise_drive(2, 9.0), "fit"), (noise_drive(3, 7.5), "test")]
    records = [(drive, measured(plant, drive, hold=hold), use) for drive, use in drives]  # type: ignore[arg-type]
    manifest = write_case(folder, records)
    words = ["diagnose", str(manifest), "--model", str(folder / "model.toml"), "--out", str(folder / "out")]
    assert main([*words, "--mechanisms", tried]) == 0
    return capsys.readouterr().out, (folder / "out" / "report.html").read_text()


def test_a_wrong_hold_is_to_be_written_before_anything_else(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said, page = answered(tmp_path, capsys, device(), "zero", "input.hold,friction.coulomb,stiffness.cubic")
    assert said.startswith(
        f"The hold in the manifest does not fit the data: {FIRST}. Then run rtctl identify and rtctl diagnose again"
    )
    assert "Measure this next" not in said
    last = said.strip().splitlines()[-1]
    model, out = tmp_path / "model.toml", tmp_path / "out" / "model.toml"
    assert (
        last
        == f"now {FIRST}, then run: rtctl identify {tmp_path / 'dataset.toml'} --model {model} --out {out}"
    )
    (headline,) = re.findall("<h1>(.*?)</h1>", page)
    assert headline.startswith(
        f'<span class="partly_explained">The hold in the manifest does not fit the data: {FIRST}. With it, the residual'
    )
    (to_do,) = re.findall("<h3>What to do</h3><ul>(.*?)</ul>", page)
    assert to_do.startswith(f"<li>W{FIRST[1:]}. Then run rtctl identify")
    assert "model-extended" not in to_do
    assert "acquire" not in to_do


@pytest.mark.parametrize(
    ("identity", "share", "expected"),
    [
        ("input.hold", 0.99, FIRST),
        ("input.u.hold", 0.99, 'write hold = "zero" in [signals.u] of the manifest'),
        ("input.u.hold", 0.3, ""),
        ("input.u.delay", 0.99, ""),
    ],
)
def test_a_hold_is_to_be_written_for_the_input_that_goes_on_so(
    identity: str, share: float, expected: str
) -> None:
    parameters = {name: Estimate(share if name == "toward_zero" else 0.0, 0.0, 1.0, "1") for name in HOLDS}
    cause = Cause(identity, "", "mechanism", 0.9, parameters, 1.0, ())
    assert correction_of([cause], "drive") == expected


def test_a_delay_is_said_to_be_uncertain_by_half_a_sample(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said, _ = answered(tmp_path, capsys, device(LATE), "linear", "drive.delay,stiffness.cubic")
    assert "drive.delay: The drive acts" in said
    assert "note: drive.delay is uncertain by half a sample, 1 ms, beyond its interval" in said
    assert 'write hold = "zero" in [signals.drive]' in said


def test_a_lag_no_longer_than_a_sample_is_said_to_be_perhaps_the_hold(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The drive is held and the manifest says lines: half a sample is missing, which a short lag takes up."""
    said, _ = answered(tmp_path, capsys, device(SENSOR), "zero", "sensor.lag,drive.lag")
    assert (
        "note: drive.lag is no longer than a sample, and half a sample, 1 ms, is what a wrong hold looks"
        in said
    )
    assert "note: sensor.lag" not in said, "a long one is a lag"
