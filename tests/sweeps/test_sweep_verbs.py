"""Sweeps through the verbs: identify, simulate, preview and diagnose, on responses by harmonic balance."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from sweep_cases import CUBIC, DAMPING, GAIN, STIFFNESS, UP, Sweep, response, sweeps, write_sweeps

import rtctl
from rtctl.border.errors import InputError
from rtctl.identification.sweep_record import find_jumps


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Sweeps of a Duffing resonator in `dataset.toml`, and the model that was identified from them."""
    made = tmp_path_factory.mktemp("sweeps")
    fit = rtctl.identify(write_sweeps(made, sweeps()))
    assert fit.trusted
    fit.save(made / "model.toml", plot=True)
    return made


def test_identify_finds_the_resonator_within_its_errors(folder: Path) -> None:
    model = rtctl.read_model(folder / "model.toml")
    truth = {"damping": DAMPING, "stiffness": STIFFNESS, "stiffness_cubic": CUBIC, "drive_gain": GAIN}
    for name, expected in truth.items():
        found = model.parameters[name]
        assert abs(found.value - expected) < 4.0 * found.standard_error, name
        assert found.standard_error < 0.01 * abs(expected), name
    assert (folder / "model.png").is_file()


def test_simulate_scores_each_sweep_in_the_unit_of_the_response(folder: Path) -> None:
    compared = rtctl.simulate(folder / "model.toml", folder / "dataset.toml", out=folder / "out")
    compared.save(folder / "out")
    for score in compared.scores:
        assert (score.output, score.unit) == ("displacement", "um")
        if score.record in ("s0", "s3"):  # these do not jump
            assert score.rms_error == pytest.approx(0.002, rel=0.3)
    table = pq.read_table(folder / "out" / "s0.parquet").to_pydict()
    apart = np.hypot(table["error_in_phase"], table["error_quadrature"])
    first = next(one for one in compared.scores if one.record == "s0")
    assert np.sqrt(np.mean(apart**2) / 2.0) == pytest.approx(first.rms_error)
    assert json.loads((folder / "out" / "summary.json").read_text())["records"][0]["sample_rate_hz"] is None
    assert (folder / "out" / "worst.png").is_file()


def test_preview_says_which_way_each_sweep_goes(folder: Path) -> None:
    shown = rtctl.preview(folder / "dataset.toml")
    assert [one.gaps for one in shown.records][1:3] == ["sweep from 95 to 106 Hz", "sweep from 106 to 95 Hz"]
    assert shown.records[0].rows == len(UP)
    assert len(shown.plot().axes) == 2


def test_rows_beside_a_jump_are_found_also_where_one_was_read_on_the_way() -> None:
    z = response(UP, 0.4)
    smooth = np.where(np.arange(len(UP)) < 30, 1.0, 0.2) * np.exp(-0.01j * np.arange(len(UP)))
    assert find_jumps(smooth).tolist() == [29]
    smooth[30] = 0.6
    assert find_jumps(smooth).tolist() == [29, 30]
    assert len(find_jumps(response(UP, 0.02))) == 0
    assert len(find_jumps(z)) <= 1


def test_fewer_rows_than_parameters_are_refused(tmp_path: Path) -> None:
    path = write_sweeps(tmp_path, [Sweep(UP[:5], 0.08, response(UP[:5], 0.08), "fit")])
    with pytest.raises(
        InputError, match="the sweeps to fit have 5 rows for 4 parameters; at least 6 are needed"
    ):
        rtctl.identify(path)
