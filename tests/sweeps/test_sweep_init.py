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
    with pytest.raises(InputError, match=r"nobody tells the amplitude of the drive.* --drive-amplitude"):
        rtctl.init(path)
    said = rtctl.init(path, drive_amplitude="20 mV rms")
    assert said.dataset.units["drive"] == "mV"
    np.testing.assert_allclose(said.dataset.records[0].signals["drive"], 20.0 * np.sqrt(2.0))


@pytest.mark.parametrize(
    ("name", "line", "amplitude_v"),
    [
        ("dev1_sweep_{0:03d}mV.csv", "", (0.02, 0.05)),
        ("fork2_{0}mVpp_up.csv", "", (0.01, 0.025)),
        ("sweep{1}.csv", "% demod 1 gain 10 mV, drive {0} mV pk, settling 20 tau\n", (0.02, 0.05)),
        ("s{1}_0p{0}V.csv", "# V_ac: 0.{0} V", (0.2, 0.5)),
        ("s{1}.csv", "# Anregung 0,{0} Vrms", (0.2 * 2**0.5, 0.5 * 2**0.5)),
    ],
)
def test_the_level_of_each_sweep_stands_in_its_name_or_its_words(
    name: str, line: str, amplitude_v: tuple[float, float], tmp_path: Path
) -> None:
    files = []
    levels = (20, 50) if amplitude_v[1] < 0.1 else (2, 5)
    for k, level in enumerate(levels):
        said = line.format(level, k).rstrip("\n")
        header = (f"{said}\n" if said else "") + "f [Hz],R [um],theta [deg]"
        path = tmp_path / name.format(level, k)
        files.append(write(path, header, UP, np.abs(Z), np.rad2deg(np.angle(Z))))
    made = rtctl.init(files)
    shown = [
        one.signals["drive"][0] * {"V": 1.0, "mV": 1e-3}[made.dataset.units["drive"]]
        for one in made.dataset.records
    ]
    assert shown == pytest.approx(amplitude_v)
    assert any("amplitudes of the sweeps stand in" in one for one in made.unsure)


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("sample_2A.csv", ""),
        ("dev_bias_5V_sweep.csv", ""),
        ("sweep_20mV_50mV.csv", ""),
        ("sweep_20mV.csv", "# drive 50 mV pk\n"),
        ("sweep.csv", "# drive gain 20 mV, sensitivity of the output 50 mV\n"),
    ],
)
def test_a_level_that_nobody_states_clearly_is_not_guessed(name: str, line: str, tmp_path: Path) -> None:
    path = write(tmp_path / name, line + "f [Hz],R [um],theta [deg]", UP, np.abs(Z), np.rad2deg(np.angle(Z)))
    with pytest.raises(InputError, match="nobody tells the amplitude of the drive"):
        rtctl.init(path)


def test_what_is_no_amplitude_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "run.csv", "f [Hz],x [um],y [um]", UP, Z.real, Z.imag)
    for wrong in ("20", "0 mV", "mV", "-3 V", "20 dB", "5 Hz", "3 s"):
        with pytest.raises(InputError, match="is no amplitude"):
            rtctl.init(path, drive_amplitude=wrong)


def test_a_time_and_two_signals_called_x_and_y_are_no_sweep(tmp_path: Path) -> None:
    path = write(
        tmp_path / "run.csv",
        "t [s],u [V],x [um]",
        1e-3 * np.arange(400),
        np.sin(np.arange(400.0)),
        np.cos(np.arange(400.0)),
    )
    assert not rtctl.init(path).dataset.has_sweeps
