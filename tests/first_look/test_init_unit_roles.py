"""A unit that does not fit its signal: swapped columns are refused, a sensor without calibration is told."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from first_look_cases import motion, write_text

import rtctl
from rtctl.border.errors import InputError

M = motion(600)


@pytest.mark.parametrize(
    ("head", "inputs", "output", "remedy"),
    [
        ("t [s],DA [V],Gauge [mm]\n", "Gauge [mm]", "displacement=DA [V]", "--input 'DA [V]'"),
        ("t [s],Current/A,Velocity/mm/s\n", "Velocity/mm/s", "velocity=Current/A:mm/s", "--input Current/A"),
        ("t [s],p [kPa],angle [deg]\n", "angle [deg]", "displacement=p [kPa]", "displacement=angle [deg]"),
        ("t [s],ch1,ch2\n", "ch2:um", "displacement=ch1:V", "--input ch1:V --output displacement=ch2:um"),
    ],
)
def test_swapped_columns_are_refused_with_the_options_that_swap_them_back(
    tmp_path: Path, head: str, inputs: str, output: str, remedy: str
) -> None:
    path = write_text(tmp_path / "r.csv", head, M.t, M.u, M.x)
    with pytest.raises(InputError, match="drive and response are swapped") as refused:
        rtctl.init(path, inputs=inputs, outputs=output, plot=False)
    assert remedy in str(refused.value)
    assert list(tmp_path.iterdir()) == [path]
    words = shlex.split(str(refused.value).partition("; say ")[2].partition(". Where")[0])
    found = rtctl.init(path, inputs=words[1], outputs=words[3], plot=False)
    assert not [one for one in found.unsure if "swapped" in one or "uncalibrated" in one]


@pytest.mark.parametrize(
    ("head", "inputs", "outputs", "scales", "told"),
    [
        ("t [s],u [V],sensor [V]\n", "u", "displacement=sensor", (), "an uncalibrated sensor?"),
        ("t [s],u [V],gauge [mV]\n", "u", "displacement=gauge", (), "displacement=NUMBER mm/mV"),
        ("t [s],u [V],x [mm]\n", "u", "displacement=x", (), ""),
        ("t [s],u [V],sensor [V]\n", "u", "displacement=sensor", "displacement=0.5 mm/V", ""),
        ("t [s],base [m/s^2],sensor [V]\n", "base", "displacement=sensor", (), "an uncalibrated sensor?"),
        ("t [s],base [mm],sensor [V]\n", "base", "displacement=sensor", "displacement=1 mm/V", "is it what drives"),
        ("t [s],base [mm],tip [mm]\n", "base", "displacement=tip", (), "is it what drives"),
        ("t [s],u [V],x\n", "u", "displacement=x:dimensionless", (), ""),
    ],
)  # fmt: skip
def test_an_unusual_unit_is_told_and_possible(
    tmp_path: Path, head: str, inputs: str, outputs: str, scales: str, told: str
) -> None:
    path = write_text(tmp_path / "r.csv", head, M.t, M.u, M.x)
    found = rtctl.init(path, inputs=inputs, outputs=outputs, scales=scales, plot=False)
    doubts = [one for one in found.unsure if "uncalibrated" in one or "is it what drives" in one]
    assert len(doubts) == (told != "")
    assert not told or told in doubts[0]


def test_a_named_base_acceleration_is_the_input_of_the_manifest(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "t [s],base,x [mm]\n", M.t, M.u, M.x)
    found = rtctl.init(path, inputs="base_acceleration=base:g", plot=False)
    assert "[signals.base_acceleration]" in found.path.read_text(encoding="utf-8")
    (drive,) = [one for one in found.summary.signals if one.role == "input"]
    assert (drive.column, drive.unit_from) == ("base", "given")


def test_a_torque_in_nm_is_no_doubt_where_newton_metres_are_said(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "t [s],torque_Nm,angle [deg]\n", M.t, 0.0 * M.u, M.x)
    found = rtctl.init(path, inputs="torque_Nm:N*m", plot=False)
    assert not any("Nm" in text for text in found.unsure)
    assert "torque_Nm" not in found.proposal.unused
