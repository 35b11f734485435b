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


def free_motion(seed: int) -> np.ndarray:
    """Return a decaying motion [mm] of 80 (rad/s), 4 1/s, rows of 1 ms."""
    t = 1e-3 * np.arange(1500)
    return 3.0 * np.exp(-2.0 * t) * np.cos(80.0 * t + seed) + 1e-3 * np.random.default_rng(seed).normal(
        size=1500
    )


def test_a_release_whose_file_has_no_drive_at_all(tmp_path: Path) -> None:
    files = [
        write_text(tmp_path / f"r{k}.csv", "t [s],x [mm]\n", 1e-3 * np.arange(1500), free_motion(k))
        for k in range(2)
    ]
    found = rtctl.init(files)
    assert "constant = 0.0  # no column drives, and the motion decays" in found.path.read_text(
        encoding="utf-8"
    )
    assert any("if something drove, record it beside" in one for one in found.unsure)
    record = found.dataset.records[0]
    assert not record.signals["drive"].any()
    assert len(record.signals["drive"]) == record.samples
    fit = rtctl.identify(found.path)
    assert fit.parameters["damping"].value == pytest.approx(4.0, rel=0.01)
    assert fit.parameters["stiffness"].value == pytest.approx(80.0**2 + 4.0, rel=0.001)
    assert "drive_gain" not in fit.parameters


def test_a_motion_that_goes_on_without_a_drive_is_asked_about(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "t [s],x [mm]\n", M.t, M.x)
    with pytest.raises(InputError, match="--input -"):
        rtctl.init(path, plot=False)
    assert "constant = 0.0  # you said so" in rtctl.init(path, inputs="-", plot=False).path.read_text(
        encoding="utf-8"
    )


def test_a_column_beside_a_release_is_told_as_not_used(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "t [s],force [N],x [mm]\n", M.t, M.u, M.x)
    text = rtctl.init(path, inputs="-", plot=False).path.read_text(encoding="utf-8")
    assert '# Not used: column "force [N]": you said so: nothing drives' in text


def test_an_actuator_that_is_heated_has_a_current(tmp_path: Path) -> None:
    """Its column was left out for a current of 0 mA."""
    path = write_text(tmp_path / "v.csv", "t [s],I [mA],R [ohm]\n", M.t, 5.0 + M.u, 2e4 - 1e3 * M.x)
    with pytest.raises(InputError, match=r'signal "current" is missing.*and its unit in mA\n'):
        rtctl.init(path, plant="vo2", inputs="-", plot=False)
