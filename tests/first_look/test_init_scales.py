"""The scale of a transducer: said to init as it stands on its data sheet, and told once where nobody applies it."""

from __future__ import annotations

from pathlib import Path

import h5py
import pytest
from first_look_cases import motion

import rtctl
from rtctl.border.errors import InputError
from rtctl.cli.dialogue import ask_all
from rtctl.measured.proposal.proposal import Answers
from rtctl.measured.proposal.scales import scale_of
from rtctl.measured.proposal.survey import survey_files


@pytest.mark.parametrize(
    ("said", "column", "value", "unit"),
    [
        ("22.4 mV/N", "V", 1.0 / 22.4e-3, "N"),
        ("22.4 mV/N", "mV", 1.0 / 22.4, "N"),
        ("44.6 N/V", "V", 44.6, "N"),
        ("44.6 N/V", "mV", 44.6e-3, "N"),
        ("100 mV/g", "V", 10.0, "g_0"),
        ("10.2 mV/(m/s^2)", "V", 1.0 / 10.2e-3, "m/s^2"),
        ("98 m/s^2/V", "V", 98.0, "m/s^2"),
        ("0.3052 mV", "", 0.3052, "mV"),
        ("-2 mm/V", "V", -2.0, "mm"),
    ],
)
def test_a_sensitivity_divides_and_a_scale_multiplies(
    said: str, column: str, value: float, unit: str
) -> None:
    found = scale_of({"drive": said}, "drive", "c", column)
    assert found is not None
    assert (found.value, found.unit) == (pytest.approx(value, rel=1e-12), unit)


@pytest.mark.parametrize(
    ("said", "column", "words"),
    [
        ("22.4", "V", "does not tell what 1 V of the column is"),
        ("0 mV/N", "V", "a number that is not 0"),
        ("many mV/N", "V", "NAME=NUMBER UNIT"),
        ("5 A/N", "V", "does not tell what 1 V of the column is"),
        ("2 V/V", "V", "does not tell what 1 V of the column is"),
        ("22.4 mV/N", "", "nobody states the unit of the column"),
        ("3 mm/degC", "degC", "no scale fits it"),
    ],
)
def test_what_fits_no_column_is_refused(said: str, column: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        scale_of({"drive": said}, "drive", "c", column)
    assert f"--scale 'drive={said}'" in str(caught.value)


@pytest.mark.parametrize(
    ("scales", "words"),
    [
        (["force=2 N/V"], 'no signal "force"'),
        (["drive"], "is not NAME=NUMBER UNIT"),
        (["drive=1 N/V", "drive=2 N/V"], "given twice"),
    ],
)
def test_a_scale_needs_its_signal(tmp_path: Path, scales: list[str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        rtctl.init(volts(tmp_path), scales=scales, plot=False)


def volts(folder: Path, groups: int = 1) -> Path:
    with h5py.File(folder / "r.h5", "w") as file:
        for k in range(groups):
            one = motion(600, seed=k)
            file[f"run{k}/force"], file[f"run{k}/pos"] = 22.4e-3 * one.u, 2.5 * one.x
            for name, told in (("force", "22.4 mV/N"), ("pos", "2.5 V/mm")):
                file[f"run{k}/{name}"].attrs.update({"unit": "V", "sensitivity": told})
        file.attrs["sample_rate_Hz"] = 1000
    return folder / "r.h5"


def test_the_remark_comes_once_a_signal_and_not_where_the_manifest_scales(tmp_path: Path) -> None:
    path = volts(tmp_path, 5)
    remarks = rtctl.read_dataset(rtctl.init(path, plot=False).path).remarks
    told = [one for one in remarks if "sensitivity" in one]
    assert len(told) == 2
    assert "into [signals.drive]" in told[0]
    assert "--scale 'drive=22.4 mV/N'" in told[0]
    found = rtctl.init(
        path, scales={"drive": "22.4 mV/N", "displacement": "2.5 V/mm"}, plot=False, force=True
    )
    data = rtctl.read_dataset(found.path)
    assert not [one for one in data.remarks if "sensitivity" in one]
    assert data.units == {"drive": "N", "displacement": "mm"}
    assert data.records[2].signals["drive"] == pytest.approx(motion(600, seed=2).u, rel=1e-9)


def test_the_dialogue_does_not_ask_for_a_unit_that_a_scale_gives(tmp_path: Path) -> None:
    prompts: list[str] = []

    def ask(prompt: str) -> str:
        prompts.append(prompt)
        return ""

    proposal = ask_all(survey_files([volts(tmp_path)]), Answers(scales=("drive=22.4 mV/N",)), ask)
    assert not [one for one in prompts if one.startswith('In which unit is "run0/force"')]
    assert [one for one in prompts if one.startswith('In which unit is "run0/pos"')]
    drive = proposal.signal("drive")
    assert drive is not None
    assert (drive.unit, drive.scale) == ("N", pytest.approx(1.0 / 22.4e-3))
