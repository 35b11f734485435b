"""A release: the column of zeros whose name says that it drives is the drive; no other constant column is."""

from __future__ import annotations

from pathlib import Path

import first_look_cases
import numpy as np
import pytest
from first_look_cases import write_text

import rtctl
from rtctl.border.errors import InputError

M = first_look_cases.motion(600)
ZEROS = np.zeros_like(M.x)
DECAY = np.exp(-4.0 * np.linspace(0.0, 1.0, len(M.x))) * np.cos(40.0 * np.linspace(0.0, 1.0, len(M.x)))


@pytest.mark.parametrize("drive", ["torque [N*m]", "force_N", "u [V]"])
def test_a_drive_that_is_zero_throughout_is_the_drive(tmp_path: Path, drive: str) -> None:
    path = write_text(
        tmp_path / "r.csv", f"t [s],temperature [degC],{drive},x [mm]\n", M.t, ZEROS + 21.5, ZEROS, DECAY
    )
    found = rtctl.init(path, plot=False)
    manifest = found.path.read_text(encoding="utf-8")
    assert f'column = "{drive}"  # by its name; it is 0 throughout, as in a release' in manifest
    assert not [one for one in found.unsure if "drive" in one]


def test_a_drive_that_varies_comes_before_one_of_zeros(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "t [s],force [N],u [V],x [mm]\n", M.t, ZEROS, M.u, M.x)
    assert 'column = "u [V]"' in rtctl.init(path, plot=False).path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("name", "values", "motion"),
    [
        pytest.param("u [V]", ZEROS + 1.0, DECAY, id="a constant that is not zero"),
        pytest.param("spare", ZEROS, DECAY, id="a name that says nothing"),
        pytest.param("u [V]", ZEROS, M.x, id="a motion that goes on: the drive was not recorded"),
    ],
)
def test_other_constants_are_asked_about(
    tmp_path: Path, name: str, values: np.ndarray, motion: np.ndarray
) -> None:
    path = write_text(tmp_path / "r.csv", f"t [s],{name},x [mm]\n", M.t, values, motion)
    with pytest.raises(InputError, match="drive"):
        rtctl.init(path, plot=False)
