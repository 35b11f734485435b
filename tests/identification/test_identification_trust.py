"""`rtctl identify` trusts a model only where free runs follow the data, and says what the data lack."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import rtctl
from rtctl.border.arrays import FloatArray

PERIOD_S = 1e-3
DAMPING, STIFFNESS, GAIN = 8.0, 16_000.0, 450.0
SAMPLES = 1500


def played(drive: FloatArray, start: float = 0.0) -> FloatArray:
    """z'' + 8 z' + 16000 z = 450 u, u held, by the exact discrete solution; 1 % noise."""
    from scipy.linalg import expm

    system = np.array([[0.0, 1.0, 0.0], [-STIFFNESS, -DAMPING, GAIN], [0.0, 0.0, 0.0]])
    step = expm(system * PERIOD_S)
    state, found = np.array([start, 0.0]), np.empty(len(drive))
    for k, u in enumerate(drive):
        found[k] = state[0]
        state = step[:2, :2] @ state + step[:2, 2] * u
    noise = np.random.default_rng(3).standard_normal(len(drive))
    return found + 0.01 * found.std() * noise


def noise_drive(seed: int) -> FloatArray:
    drive = np.convolve(np.random.default_rng(seed).standard_normal(SAMPLES + 16), np.hanning(16), "valid")
    return drive[:SAMPLES]


def identified(folder: Path, *records: tuple[FloatArray, FloatArray]) -> rtctl.Fit:
    return rtctl.identify(
        rtctl.write_dataset(
            folder,
            [
                rtctl.Record(name=f"r{k}", period_s=PERIOD_S, signals={"drive": u, "displacement": z})
                for k, (u, z) in enumerate(records)
            ],
            name="trust", plant="oscillator", units={"drive": "V", "displacement": "mm"},
        )
    )  # fmt: skip


def test_a_right_model_is_trusted(tmp_path: Path) -> None:
    drive = noise_drive(1)
    fit = identified(tmp_path, (drive, played(drive)))
    assert fit.trusted
    assert fit.parameters["damping"].value == pytest.approx(DAMPING, rel=0.01)


@pytest.mark.parametrize(
    "spoil",
    [
        pytest.param(lambda u, z: (u, np.concatenate((np.zeros(20), z[:-20]))), id="20 samples late"),
        pytest.param(lambda u, z: (u + 30.0 * u.std(), z), id="drive with an offset", marks=pytest.mark.slow),
        pytest.param(
            lambda u, z: (u, z + np.linspace(0.0, 30.0 * z.std(), len(z))),
            id="a sensor that drifts",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            lambda u, z: (np.zeros(len(u)), z), id="drive that was not recorded", marks=pytest.mark.slow
        ),
    ],
)
def test_segments_that_follow_do_not_make_a_model_trusted(
    spoil: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]], tmp_path: Path
) -> None:
    drives = [noise_drive(1), noise_drive(2)]
    fit = identified(tmp_path, *(spoil(drive, played(drive)) for drive in drives))
    assert not fit.trusted
    assert fit.warnings[0].startswith("do not use this model, because it ")
    advice = [fit.warnings[0].index(one) for one in ("rtctl diagnose", "--model", "swapped")]
    assert advice == sorted(advice), "what helps comes before what it might be"
    assert all(one.standard_error is None for one in fit.parameters.values())


@pytest.mark.parametrize("level", [0.0, 2.0])
def test_a_ring_down_gives_damping_and_stiffness_and_no_gain(level: float, tmp_path: Path) -> None:
    rest = np.zeros(SAMPLES)
    fit = identified(tmp_path, (rest + level, played(rest, start=1.0)))
    assert fit.trusted
    assert "drive_gain" not in fit.parameters
    assert fit.parameters["damping"].value == pytest.approx(DAMPING, rel=0.02)
    assert fit.parameters["stiffness"].value == pytest.approx(STIFFNESS, rel=1e-3)
    assert any("nothing shows the gain from it to the motion" in one for one in fit.warnings)


@pytest.mark.parametrize("samples", [2, 5, 59])
def test_too_few_samples_are_refused(samples: int, tmp_path: Path) -> None:
    drive = noise_drive(1)
    with pytest.raises(
        rtctl.InputError, match=rf"{samples} scored samples for 6 unknowns .* at least 60 are"
    ):
        identified(tmp_path, (drive[:samples], played(drive)[:samples]))


@pytest.mark.parametrize("code", [9.9e37, -9.9e37, 9.91e37])
@pytest.mark.parametrize("column", [0, 1])
def test_an_instruments_code_for_overflow_is_no_reading(code: float, column: int, tmp_path: Path) -> None:
    drive = noise_drive(1)
    record = [drive, played(drive)]
    record[column][700] = code
    with pytest.raises(rtctl.InputError, match=r"in 1 of 1500 rows: row 700 .* where a reading overflowed"):
        identified(tmp_path, (record[0], record[1]))


def test_a_dataset_whose_acquisition_ended_early_is_told(tmp_path: Path) -> None:
    drive = noise_drive(1)
    identified(tmp_path, (drive, played(drive)))
    manifest = tmp_path / "dataset.toml"
    manifest.write_text(
        manifest.read_text().replace("[dataset]", '[dataset]\nincomplete = "frozen_value: r"', 1)
    )
    fit = rtctl.identify(manifest)
    assert fit.warnings[0].startswith(
        "the dataset is incomplete, because its acquisition ended early (frozen_v"
    )
    assert fit.to_dict()["warnings"][0] == fit.warnings[0]


@pytest.mark.parametrize("level", [0.0, 0.7])
def test_an_output_that_never_moves_is_told(level: float, tmp_path: Path) -> None:
    drive = noise_drive(1)
    with pytest.raises(rtctl.InputError, match=r"record r0: nothing moves, all outputs are constant"):
        identified(tmp_path, (drive, np.full(SAMPLES, level)))


@pytest.mark.parametrize("size", [1e-200, 1e-61])
def test_numbers_that_vanish_when_they_are_squared_are_told(size: float, tmp_path: Path) -> None:
    drive = noise_drive(1)
    with pytest.raises(rtctl.InputError, match=r'column "displacement" is nowhere larger than'):
        identified(tmp_path, (drive, size * played(drive)))


@pytest.mark.parametrize("size", [1e-30, 1e30])
def test_a_model_does_not_depend_on_the_size_of_a_unit(size: float, tmp_path: Path) -> None:
    drive = noise_drive(1)
    fit = identified(tmp_path, (drive, size * played(drive)))
    assert fit.trusted
    assert fit.parameters["damping"].value == pytest.approx(DAMPING, rel=0.01)


def test_what_a_file_says_and_nobody_understands_is_a_warning_of_the_fit(tmp_path: Path) -> None:
    drive = noise_drive(1)
    identified(tmp_path, (drive, played(drive)))
    table = pq.read_table(tmp_path / "r0.parquet")
    fields = [pa.field(name, pa.float64(), metadata={"unit": "blorps"}) for name in table.schema.names]
    pq.write_table(table.cast(pa.schema(fields)), tmp_path / "r0.parquet")
    manifest = tmp_path / "dataset.toml"
    fit = rtctl.identify(manifest)
    assert 'column "drive": the file states "blorps", which is no known unit; taken as V' in fit.warnings[0]
    assert fit.trusted
    comparison = rtctl.simulate(fit.model, manifest)
    assert len(comparison.summary["remarks"]) == 2


@pytest.mark.parametrize("signal", ["drive", "displacement"])
def test_a_misread_sample_is_told_and_costs_nothing(tmp_path: Path, signal: str) -> None:
    drive = noise_drive(1)
    read = {"drive": drive.copy(), "displacement": played(drive)}
    read[signal][700] = 9999.0
    found = identified(tmp_path, (read["drive"], read["displacement"]))
    assert found.trusted
    assert any(f"9999 {'V' if signal == 'drive' else 'mm'} in sample 700" in note for note in found.warnings)
    assert found.parameters["drive_gain"].value == pytest.approx(GAIN, rel=0.02)


def test_what_is_no_noise_leaves_no_intervals(tmp_path: Path) -> None:
    """A drive that is read too high: the fit is usable, its intervals missed the truth by seven errors."""
    drive = noise_drive(1)
    read = drive + 0.5 * drive.std()
    found = identified(tmp_path, (read, played(drive)))
    assert found.trusted
    assert all(one.standard_error is None for one in found.parameters.values())
    assert any("this fit leaves are no noise" in note for note in found.warnings)
    assert not any("its interval" in note for note in found.warnings)
    assert any("um too high on average" in note for note in found.warnings)


def test_much_noise_leaves_intervals(tmp_path: Path) -> None:
    drive = noise_drive(1)
    z = played(drive)
    found = identified(
        tmp_path, (drive, z + 0.1 * z.std() * np.random.default_rng(4).standard_normal(len(z)))
    )
    gain = found.parameters["drive_gain"]
    assert gain.standard_error is not None
    assert abs(gain.value - GAIN) < 4.0 * gain.standard_error
