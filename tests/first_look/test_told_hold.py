"""A sentence in a file that states the hold is read as stated; neighbours that only sound like one are not."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from first_look_cases import motion, write_text
from measured_files import write_tdms
from scipy.io import savemat

import rtctl
from rtctl.measured.proposal.between_rows.told_hold import says_held

M = motion(600)


@pytest.mark.parametrize(
    "text",
    [
        "# controller: D/A output is a zero-order hold, A/D samples at the same instants",
        "# Zero-Order Hold",
        "hold: ZOH",
        "Hold = zero",
        "# drive: 0-order hold (16 bit)",
        "% u is zeroth-order hold",
        "# D/A holds each value until the next one",
        "# the DAC output is held between samples",
        "# DAC with sample and hold",
        "# D/A: sample-and-hold",
        "# Ausgang: Halteglied nullter Ordnung",
        "# Halteglied 0. Ordnung",
        "# D/A-Wandler hält jeden Wert bis zum nächsten",
        "# DA-Wandler mit Abtast-Halte-Glied",
        "# sensor: laser, drive: zero-order hold",
        "# Stellgröße wird zwischen den Abtastungen gehalten",
        "# bloqueur d'ordre zéro",
    ],
)
def test_a_stated_hold(text: str) -> None:
    assert says_held(text)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "# hold time 5 s",
        "# Haltezeit: 3 s",
        "# DAC held at 0 V before the start",
        "# D/A held in reset",
        "# drive amplitude held constant",
        "# temperature is held at 23 degC",
        "# no zero-order hold",
        "# D/A does not hold its value",
        "# D/A without sample and hold",
        "# the output is not a ZOH",
        "# kein Halteglied nullter Ordnung",
        "# D/A ohne Halteglied",
        "# first-order hold",
        "# Halteglied erster Ordnung",
        "# A/D with simultaneous sample and hold",
        "# sample-and-hold inputs, 16 channels",
        "# position: sample and hold",
        "# model discretised by zero-order hold",
        "# plant c2d zoh",
        "# ZOH compensated",
        "# gauge resampled with zero-order hold",
        "# a reconstruction filter follows the zero-order hold",
        "# zero-order hold or linear?",
        "# threshold 3 V",
        "# household supply, DAC 16 bit",
        "# the command to hold on",
        "# zohar's bench",
        "# shareholder D/A",
        "# polynomial of 10. Ordnung",
        "# Filter 0. Ordnung",
    ],
)
def test_a_sentence_that_states_no_hold_of_the_drive(text: str) -> None:
    assert not says_held(text)


SENTENCE = "D/A output is a zero-order hold"


def text_file(folder: Path, sentence: str) -> Path:
    return write_text(folder / "r.txt", f"# rate 1 kHz\n# {sentence}\nt [s],u [V],x [mm]\n", M.t, M.u, M.x)


def hdf5(folder: Path, sentence: str) -> Path:
    with h5py.File(folder / "r.h5", "w") as file:
        for name, values in (("t [s]", M.t), ("u [V]", M.u), ("x [mm]", M.x)):
            file[f"run/{name}"] = values
        file["run"].attrs["comment"] = sentence
    return folder / "r.h5"


def tdms(folder: Path, sentence: str) -> Path:
    properties = {name: {"wf_increment": 1e-3, "note": sentence} for name in ("u [V]", "x [mm]")}
    write_tdms(folder / "r.tdms", {"u [V]": M.u, "x [mm]": M.x}, properties)
    return folder / "r.tdms"


def parquet(folder: Path, sentence: str) -> Path:
    table = pa.table({"t [s]": M.t, "u [V]": M.u, "x [mm]": M.x})
    pyarrow.parquet.write_table(table.replace_schema_metadata({"comment": sentence}), folder / "r.parquet")
    return folder / "r.parquet"


def variable(folder: Path, sentence: str) -> Path:
    savemat(folder / "r.mat", {"t_s": M.t, "u_V": M.u, "x_mm": M.x, "info": {"remark": sentence}})
    return folder / "r.mat"


def array(folder: Path, sentence: str) -> Path:
    np.savez(folder / "r.npz", **{"t [s]": M.t, "u [V]": M.u, "x [mm]": M.x, "note": np.array([sentence])})  # type: ignore[arg-type]
    return folder / "r.npz"


WAYS = [text_file, hdf5, tdms, parquet, variable, array]


@pytest.mark.parametrize("write", WAYS, ids=lambda one: one.__name__)
def test_the_sentence_is_taken_and_told_wherever_it_stands(tmp_path: Path, write) -> None:  # type: ignore[no-untyped-def]
    found = rtctl.init(write(tmp_path, SENTENCE), plot=False)
    guess = found.proposal.signal("drive")
    assert guess is not None
    assert guess.hold == "zero"
    assert SENTENCE in guess.hold_why
    assert SENTENCE in found.path.read_text()
    assert [one for one in found.unsure if "do not show how it goes on" in one] == []
    assert len([one for one in found.unsure if 'hold = "zero" by' in one]) == 1


@pytest.mark.parametrize("write", WAYS, ids=lambda one: one.__name__)
def test_another_sentence_changes_nothing(tmp_path: Path, write) -> None:  # type: ignore[no-untyped-def]
    found = rtctl.init(write(tmp_path, "A/D with sample and hold"), plot=False)
    assert found.dataset.holds == {"drive": "band-limited"}


def test_an_option_counts_more_and_the_contradiction_is_told(tmp_path: Path) -> None:
    found = rtctl.init(text_file(tmp_path, SENTENCE), hold="linear", plot=False)
    assert found.dataset.holds == {"drive": "linear"}
    assert any('hold = "linear", as you said, but line 2' in one for one in found.unsure)
