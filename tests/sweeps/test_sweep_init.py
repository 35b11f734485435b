"""`rtctl init` on files of sweeps: recognised, written, or refused with what is missing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from sweep_cases import UP, response

import rtctl
from rtctl.border.errors import InputError

Z = response(UP, 0.08)
BOTH = np.concatenate([UP, UP[::-1]])


def write(path: Path, header: str, *columns: np.ndarray) -> Path:
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="")
    return path


def test_both_directions_of_a_lock_in_become_records(tmp_path: Path) -> None:
    z = np.concatenate([Z, Z[::-1]])
    path = write(
        tmp_path / "run.csv",
        "f [kHz],drive [V],R [um],theta [deg]",
        1e-3 * BOTH,
        np.full(len(z), 0.08),
        np.abs(z),
        np.rad2deg(np.angle(z)),
    )
    made = rtctl.init(path)
    assert [one.use for one in made.dataset.records] == ["fit", "test"]
    up, down = made.dataset.records
    np.testing.assert_allclose(up.frequencies_hz, UP)
    np.testing.assert_allclose(down.complex_amplitudes("displacement"), Z[::-1], rtol=1e-9)
    assert up.signals["drive"][0] == 0.08
    assert made.picture is not None


def test_a_response_per_drive_needs_no_amplitude(tmp_path: Path) -> None:
    path = write(tmp_path / "frf.csv", "Frequency [Hz],H real [(um)/V],H imag [(um)/V]", UP, Z.real, Z.imag)
    made = rtctl.init(path)
    assert made.dataset.units["drive"] == "V"
    np.testing.assert_allclose(made.dataset.records[0].complex_amplitudes("displacement"), Z, rtol=1e-9)


def test_a_missing_amplitude_is_told_with_what_to_do(tmp_path: Path) -> None:
    path = write(tmp_path / "run.csv", "f [Hz],x [um],y [um]", UP, Z.real, Z.imag)
    with pytest.raises(InputError, match=r"no column is the amplitude of the drive.* with drive_amplitude"):
        rtctl.init(path)


def test_a_time_and_two_signals_called_x_and_y_are_no_sweep(tmp_path: Path) -> None:
    path = write(
        tmp_path / "run.csv",
        "t [s],u [V],x [um]",
        1e-3 * np.arange(400),
        np.sin(np.arange(400.0)),
        np.cos(np.arange(400.0)),
    )
    assert not rtctl.init(path).dataset.has_sweeps
