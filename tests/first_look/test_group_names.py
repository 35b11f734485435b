"""The name of a group decides no column's role before the column's own name and unit do, in all formats."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping
from pathlib import Path

import h5py
import numpy as np
import pytest
from first_look_cases import motion
from measured_files import write_tdms
from scipy.io import savemat

import rtctl
from rtctl.border.errors import InputError

M = motion(600)
Units = Mapping[str, str]


def hdf5(folder: Path, columns: Mapping[str, np.ndarray], units: Units) -> Path:
    with h5py.File(folder / "r.h5", "w") as file:
        file.attrs["fs"] = 1000.0
        for name, values in columns.items():
            file[name] = values
            if name in units:
                file[name].attrs["unit"] = units[name]
    return folder / "r.h5"


def tdms(folder: Path, columns: Mapping[str, np.ndarray], units: Units) -> Path:
    properties = {name: {"wf_increment": 1e-3} for name in columns}
    for name, unit in units.items():
        properties[name] = {**properties[name], "unit_string": unit}  # type: ignore[dict-item]
    write_tdms(folder / "r.tdms", dict(columns), properties)
    return folder / "r.tdms"


def struct(folder: Path, columns: Mapping[str, np.ndarray], units: Units) -> Path:
    """Units stand in the names of fields."""
    held: dict[str, dict[str, np.ndarray]] = {}
    spelled = {"m/s^2": "ms2", "mm/s": "mm_s"}
    for name, values in columns.items():
        group, _, field = name.replace(" ", "_").partition("/")
        unit = spelled.get(units.get(name, ""), units.get(name, ""))
        held.setdefault(group, {})[f"{field}_{unit}" if unit else field] = values
    savemat(folder / "r.mat", {"fs": 1000.0, **held})
    return folder / "r.mat"


@pytest.mark.parametrize("write", [hdf5, tdms, struct], ids=lambda one: one.__name__)
@pytest.mark.parametrize(
    ("drive", "response", "units", "role"),
    [
        ("shaker run/force", "shaker run/acc", ("N", "m/s^2"), "acceleration"),
        ("shaker run/force", "shaker run/x", ("N", "mm"), "displacement"),
        ("displacement test/u", "displacement test/v", ("V", "mm/s"), "velocity"),
        ("acceleration/exc", "acceleration/pos", ("V", "mm"), "displacement"),
        ("time signals/drive", "time signals/disp", ("V", "mm"), "displacement"),
        ("input/ch1", "input/ch2", ("V", "mm"), "displacement"),
        ("force/data", "acc/data", ("V", "m/s^2"), "acceleration"),
    ],
)
def test_the_own_name_and_unit_decide(
    tmp_path: Path, write: Callable[..., Path], drive: str, response: str, units: tuple[str, str], role: str
) -> None:
    columns = {response: M.x, drive: M.u}
    path = write(tmp_path, columns, {drive: units[0], response: units[1]})
    found = rtctl.init(path, plot=False)
    guessed = {one.name: one.column.replace("_", " ") for one in found.proposal.signals}
    assert set(guessed) == {"drive", role}
    for name, meant in (("drive", drive), (role, response)):
        assert set(meant.replace("/", " ").replace(".", " ").split()[-1:]) <= set(
            guessed[name].replace("/", " ").replace(".", " ").split()
        )


@pytest.mark.parametrize("write", [hdf5, tdms, struct], ids=lambda one: one.__name__)
def test_the_group_tells_where_its_only_column_does_not(tmp_path: Path, write: Callable[..., Path]) -> None:
    path = write(tmp_path, {"acc/data": M.a, "force/data": M.u}, {"acc/data": "m/s^2", "force/data": "N"})
    found = rtctl.init(path, plot=False)
    guess = found.proposal.signal("drive")
    assert guess is not None
    assert guess.column.startswith("force")


def test_groups_name_uncalibrated_channels(tmp_path: Path) -> None:
    units = {"acc/data": "V", "force/data": "V"}
    found = rtctl.init(hdf5(tmp_path, {"acc/data": M.a, "force/data": M.u}, units), plot=False)
    assert {one.name: one.column for one in found.proposal.signals} == {
        "drive": "force/data",
        "acceleration": "acc/data",
    }


def test_a_unit_after_a_slash_is_no_group(tmp_path: Path) -> None:
    found = rtctl.init(hdf5(tmp_path, {"Kraft/N": M.u, "Geschwindigkeit/mm/s": M.v}, {}), plot=False)
    assert {one.name: (one.column, one.unit) for one in found.proposal.signals} == {
        "drive": ("Kraft/N", "N"),
        "velocity": ("Geschwindigkeit/mm/s", "mm/s"),
    }


def test_a_column_may_be_named_without_its_group(tmp_path: Path) -> None:
    path = hdf5(tmp_path, {"run/a1": M.u, "run/a2": M.x}, {"run/a1": "V", "run/a2": "mm"})
    found = rtctl.init(path, inputs="a1", outputs="displacement=A2", plot=False)
    assert [one.column for one in found.proposal.signals] == ["run/a1", "run/a2"]


def test_a_column_that_two_groups_have_is_named_with_its_group(tmp_path: Path) -> None:
    held = {"one/a1": M.u, "one/a2": M.x, "two/a1": M.u}
    path = hdf5(tmp_path, held, dict.fromkeys(held, "V"))
    with pytest.raises(InputError, match='no column "a1"'):
        rtctl.init(path, inputs="a1", outputs="displacement=a2", plot=False)


@pytest.mark.parametrize(
    "units",
    [
        {"run/ch1": "N", "run/ch2": "N"},
        {"run/ch1": "V", "run/ch2": "V"},
        {"run/force1": "N", "run/force2": "N", "run/acc": "g"},
        {"run/drive1": "V", "run/drive2": "g"},
        {"run/ch1": "N", "run/ch2": "N", "run/vel": "mm/s"},
    ],
)
def test_the_example_of_a_refusal_works(tmp_path: Path, units: Units) -> None:
    columns = {name: (M.u, M.a, M.x)[k] + 0.1 * k for k, name in enumerate(units)}
    path = hdf5(tmp_path, columns, units)
    try:
        rtctl.init(path, plot=False, out=tmp_path / "first")
        return
    except InputError as refused:
        example = str(refused).partition("for example: rtctl init ")[2]
    words = shlex.split(example.replace(":UNIT", ":mm"))[1:]
    if "MODEL.toml" in words:  # no column may be a motion
        return
    said = dict(zip(words[::2], words[1::2], strict=True))
    assert said, example
    found = rtctl.init(
        path,
        inputs=said.get("--input", ()),
        outputs=said.get("--output", ()),
        plot=False,
        out=tmp_path / "then",
    )
    assert len(found.proposal.signals) == 2
