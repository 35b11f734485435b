"""Several records in one file: groups with the same columns are records, in every format that has groups."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from first_look_cases import motion
from measured_files import write_tdms
from scipy.io import savemat

import rtctl
from rtctl.border.errors import InputError
from rtctl.cli import main
from rtctl.cli.dialogue import ask_all
from rtctl.measured.proposal.grouped import by_groups
from rtctl.measured.proposal.proposal import Answers
from rtctl.measured.proposal.survey import survey_files

RATES_HZ = (1000.0, 1000.0, 500.0)
"""Rates of the three records; their rows are the same motion from other places on."""
Columns = Mapping[str, np.ndarray]


def records() -> list[Columns]:
    made = [motion(900, rate_hz, seed) for seed, rate_hz in enumerate(RATES_HZ)]
    return [{"t": one.t, "u": one.u, "x": one.x} for one in made]


def struct_array(folder: Path) -> Path:
    rows = [(f"run {k}", one["t"], one["u"], one["x"]) for k, one in enumerate(records())]
    kinds = [("name", object), ("t_s", object), ("u_V", object), ("x_mm", object)]
    savemat(folder / "r.mat", {"rec": np.array(rows, dtype=kinds), "bias": 3.0})
    return folder / "r.mat"


def structs(folder: Path) -> Path:
    held = {
        f"run{k}": {"t_s": one["t"], "u_V": one["u"], "x_mm": one["x"]} for k, one in enumerate(records())
    }
    savemat(folder / "r.mat", held)
    return folder / "r.mat"


def cell(folder: Path) -> Path:
    items = np.empty(len(RATES_HZ), dtype=object)
    items[:] = [{"t_s": one["t"], "u_V": one["u"], "x_mm": one["x"]} for one in records()]
    savemat(folder / "r.mat", {"runs": items})
    return folder / "r.mat"


def hdf5(folder: Path, below: str = "") -> Path:
    with h5py.File(folder / "r.h5", "w") as file:
        for k, one in enumerate(records()):
            for key, unit in (("t", "s"), ("u", "V"), ("x", "mm")):
                file[f"{below}run_{k}/{key}"] = one[key]
                file[f"{below}run_{k}/{key}"].attrs["units"] = unit
        file["calibration/x"] = np.arange(7.0)
    return folder / "r.h5"


def hdf5_below(folder: Path) -> Path:
    return hdf5(folder, "day 1/")


def matlab73(folder: Path, *, cells: bool = False) -> Path:
    """As MATLAB 7.3 keeps an array of structs, or a cell of structs: by reference."""
    with h5py.File(folder / "r.mat", "w", userblock_size=512) as file:
        store = file.require_group("#refs#")
        places: dict[str, list[Any]] = {"t_s": [], "u_V": [], "x_mm": []}
        for k, one in enumerate(records()):
            for key, values in zip(places, one.values(), strict=True):
                store[f"g{k}/{key}"] = values[np.newaxis, :]
                places[key].append(store[f"g{k}/{key}"].ref)
        if cells:
            held = np.array([[store[f"g{k}"].ref for k in range(len(RATES_HZ))]], dtype=h5py.ref_dtype)
            file.create_dataset("runs", data=held, dtype=h5py.ref_dtype)
            file["runs"].attrs["MATLAB_class"] = np.bytes_("cell")
        else:
            for key, found in places.items():
                file.create_dataset(
                    f"rec/{key}", data=np.array([found], dtype=h5py.ref_dtype), dtype=h5py.ref_dtype
                )
    return folder / "r.mat"


def cell73(folder: Path) -> Path:
    return matlab73(folder, cells=True)


def tdms(folder: Path) -> Path:
    """A channel of one group alone, and a name with a slash, as units stand in it."""
    held, properties = {}, {}
    for k, one in enumerate(records()):
        for key, unit in (("u", "V"), ("x", "mm")):
            held[f"run {k}/{key}"] = one[key]
            properties[f"run {k}/{key}"] = {"unit_string": unit, "wf_increment": 1.0 / RATES_HZ[k]}
    held["run 1/spare"] = records()[1]["u"]
    write_tdms(folder / "r.tdms", held, properties)
    return folder / "r.tdms"


KINDS = [struct_array, structs, cell, hdf5, hdf5_below, matlab73, cell73, tdms]


@pytest.mark.parametrize("write", KINDS, ids=lambda one: one.__name__)
def test_each_group_is_a_record_of_its_own_numbers_and_rate(
    tmp_path: Path, write: Callable[[Path], Path]
) -> None:
    found = rtctl.init(write(tmp_path), outputs=["displacement=x"] * (write is tdms), plot=False)
    data = rtctl.read_dataset(found.path)
    assert [1.0 / one.period_s for one in data.records] == pytest.approx(RATES_HZ)
    assert len({one.group for one in data.records}) == 3
    assert len({one.name for one in data.records}) == 3
    for one, truth in zip(data.records, records(), strict=True):
        assert np.array_equal(one.signals["drive"], truth["u"])
        assert np.array_equal(one.signals["displacement"], truth["x"])
    assert [one.use for one in data.records] == ["fit", "fit", "test"]
    assert "its groups with the same columns" in " ".join(found.unsure)


@pytest.mark.parametrize("write", [struct_array, hdf5, tdms], ids=lambda one: one.__name__)
def test_a_group_that_is_not_there_is_one_message(tmp_path: Path, write: Callable[[Path], Path]) -> None:
    path = rtctl.init(write(tmp_path), outputs=["displacement=x"] * (write is tdms), plot=False).path
    text = path.read_text(encoding="utf-8")
    group = next(line for line in text.splitlines() if line.startswith("group"))
    path.write_text(text.replace(group, 'group = "run_9"', 1), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        rtctl.read_dataset(path)
    (line,) = str(caught.value).splitlines()
    assert f'records.0 "{write(tmp_path).name}" group "run_9": no group "run_9" in the file; ' in line


def test_a_file_without_groups_says_so(tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text("u [V],x [mm]\n" + "1,2\n2,1\n" * 50, encoding="utf-8")
    path = rtctl.init(tmp_path / "r.csv", sample_rate_hz=100.0, plot=False, test="none").path
    path.write_text(
        path.read_text(encoding="utf-8").replace("[[records]]", '[[records]]\ngroup = "a"'), encoding="utf-8"
    )
    with pytest.raises(InputError, match='group = "a": the file has no groups of columns; remove group'):
        rtctl.read_dataset(path)


def test_what_stands_above_the_groups_belongs_to_each_of_them(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "r.h5", "w") as file:
        for k in range(2):
            one = motion(600, seed=k)
            file[f"run_{k}/u [V]"], file[f"run_{k}/x [mm]"] = one.u, one.x
        file["t [s]"] = motion(600).t
    found = rtctl.init(tmp_path / "r.h5", plot=False)
    assert [one.period_s for one in found.dataset.records] == pytest.approx([1e-3, 1e-3])


def test_channels_in_groups_of_their_own_are_no_records(tmp_path: Path) -> None:
    one = motion(600)
    channels = np.array([(one.t, one.u), (one.t, one.x)], dtype=[("time_s", object), ("y", object)])
    savemat(tmp_path / "r.mat", {"ch": channels})
    with pytest.raises(InputError, match=r"--output 'displacement=ch\(2\).y:UNIT'"):
        rtctl.init(tmp_path / "r.mat", plot=False)


def test_the_test_is_a_group_by_its_title_or_by_the_users_word(tmp_path: Path) -> None:
    one = records()[0]
    rows = [
        (name, one["t"], one["u"], one["x"]) for name in ("chirp", "noise (validation)", "noise", "steps")
    ]
    kinds = [("name", object), ("t_s", object), ("u_V", object), ("x_mm", object)]
    savemat(tmp_path / "r.mat", {"rec": np.array(rows, dtype=kinds)})
    found = rtctl.init(tmp_path / "r.mat", plot=False)
    assert [record.use for record in found.dataset.records] == ["fit", "test", "fit", "fit"]
    found = rtctl.init(tmp_path / "r.mat", plot=False, test="rec(4)", force=True)
    assert [record.use for record in found.dataset.records] == ["fit", "fit", "fit", "test"]
    with pytest.raises(InputError, match=r'no such group or data file; did you mean "rec\(4\)"'):
        rtctl.init(tmp_path / "r.mat", plot=False, test="rec(5)", force=True)


def test_the_dialogue_names_columns_within_the_group_and_asks_for_the_time_last(tmp_path: Path) -> None:
    prompts: list[str] = []

    def ask(prompt: str) -> str:
        prompts.append(prompt)
        return ""

    surveys = by_groups(survey_files([struct_array(tmp_path)]), Answers())
    proposal = ask_all(surveys, Answers(), ask)
    asked = [one.partition("?")[0] for one in prompts]
    assert asked.index("Which column is the drive") < asked.index("Which column is the time")
    assert "Which column is the time? (- for none) [t_s] " in prompts
    assert any(one.startswith("Which group may no fit use") for one in prompts)
    assert [record.group for record in proposal.records] == ["rec(1)", "rec(2)", "rec(3)"]


def test_every_verb_works_on_groups(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init", str(struct_array(tmp_path)), "--yes", "--quiet"]) == 0
    manifest, model = str(tmp_path / "dataset.toml"), str(tmp_path / "model.toml")
    assert main(["preview", manifest, "--json", "--out", str(tmp_path / "look.png")]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert len({one["group"] for one in shown["records"]}) == 3
    assert main(["identify", manifest, "--out", model, "--quiet", "--no-plot"]) == 0
    found = rtctl.read_model(model).parameters["stiffness"].value
    assert found == pytest.approx((2.0 * np.pi * 15.0) ** 2, rel=0.02)
    assert main(["simulate", model, manifest, "--out", str(tmp_path / "s"), "--quiet", "--no-plot"]) == 0
    said = ["--mechanisms", "stiffness.cubic", "--out", str(tmp_path / "d"), "--quiet"]
    assert main(["diagnose", manifest, "--model", model, *said]) == 0
