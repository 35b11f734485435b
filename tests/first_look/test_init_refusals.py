"""What cannot be known is refused with exit 2 and the option that settles it; nothing is written then."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from first_look_cases import motion, write_text
from scipy.io import savemat

import rtctl
from rtctl.cli import main

M = motion(600)


def refusal(capsys: pytest.CaptureFixture[str], *words: str | Path) -> str:
    assert main(["init", *map(str, words), "--yes"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("rtctl init: ")
    assert "Traceback" not in said.err
    return said.err


def table(folder: Path, head: str, *columns: np.ndarray, name: str = "r.csv") -> Path:
    return write_text(folder / name, head, *columns)


def test_units_that_nobody_states_are_asked_for_and_not_guessed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = table(tmp_path, "t,u,x\n", M.t, M.u, M.x)
    said = refusal(capsys, path)
    assert 'nobody states the unit of column "u", the drive: say --input u:UNIT' in said
    assert "--output displacement=x:UNIT" in said
    assert f"rtctl init {path} --input u:UNIT --output displacement=x:UNIT" in said
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("head", "words"),
    [
        (
            "t [s],force [N],voltage [V],x [mm]\n",
            ["several columns may be the drive", '"force [N]", "voltage [V]"', "--input"],
        ),
        (
            "t [s],u [V],x1 [mm],x2 [mm]\n",
            ["several columns may be the displacement", "--output displacement="],
        ),
        ("t [s],u [V],y [V],z2 [degC]\n", ["which motion was measured", "--output displacement="]),
        (
            "t [s],ch1 [V],ch2 [V],ch3 [V]\n",
            ["several columns may be the drive", '"ch1 [V]", "ch2 [V]", "ch3 [V]"'],
        ),
        ("t [s],temp [degC],x [mm],v [mm/s]\n", ["no column looks like the drive", "--input COLUMN[:UNIT]"]),
        (
            "t [s],load [g],x [mm],n [Hz]\n",
            ["may be grams, gram-force or gravity", "--input 'load [g]:UNIT'"],
        ),
        (
            "t [s],u [EU],x [mm],n [Hz]\n",
            ['nobody states the unit of column "u [EU]"', "--input 'u [EU]:UNIT'"],
        ),
    ],
)
def test_roles_that_do_not_show(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], head: str, words: list[str]
) -> None:
    said = refusal(capsys, table(tmp_path, head, M.t, M.u, M.x, M.v))
    assert [word for word in words if word not in said] == []


@pytest.mark.parametrize("step", [1.0, 0.1, 0.05])
def test_a_time_that_may_count_milliseconds_is_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], step: float
) -> None:
    path = table(tmp_path, "t,u [V],x [mm]\n", step * np.arange(600), M.u, M.x)
    said = refusal(capsys, path)
    assert 'nobody states the unit of the time column "t"' in said
    assert "--time t:UNIT or --sample-rate HZ" in said
    found = rtctl.init(path, time="t:ms", plot=False)
    assert found.dataset.records[0].period_s == pytest.approx(1e-3 * step)


def test_a_rate_that_nobody_states(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = table(tmp_path, "u [V],x [mm]\n", M.u, M.x)
    assert "the sample rate is not known" in refusal(capsys, path)
    assert main(["init", str(path), "--yes", "--sample-rate", "1000", "--quiet"]) == 0
    assert rtctl.read_dataset(tmp_path / "dataset.toml").records[0].period_s == 1e-3


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("no.csv", None, ["no such file"]),
        ("r.csv", "", ["the file is empty (0 bytes)"]),
        ("r.csv", "x [mm]\n1\n2\n3\n", ["two columns of numbers", '"x [mm]" (3 numbers)']),
        ("r.csv", "a,b\nred,dog\nblue,cat\n", ["two columns of numbers", '"a" (holds text']),
        ("r.csv", "u [V],x [mm]\n1,2\n", ["two columns of numbers of one length", "(1 number)"]),
        ("r.xlsx", "PK", ['no reader for the suffix ".xlsx"', "convert the file"]),
        ("r.mat", "not a matlab file at all", ["not a MATLAB file"]),
        ("dataset.toml", '[dataset]\nname = "x"\n', ["is a manifest", "rtctl preview", "rtctl identify"]),
    ],
)
def test_files_that_cannot_be_used(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, content: str | None, words: list[str]
) -> None:
    if content is not None:
        (tmp_path / name).write_text(content)
    said = refusal(capsys, tmp_path / name, "--out", tmp_path / "new")
    assert str(tmp_path / name) in said
    assert [word for word in words if word not in said] == []
    assert not (tmp_path / "new").exists()


def test_a_folder_names_the_files_in_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table(tmp_path, "t [s],u [V],x [mm]\n", M.t, M.u, M.x)
    assert "is a folder; name its data files: r.csv" in refusal(capsys, tmp_path)


def test_constant_columns(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = refusal(capsys, table(tmp_path, "t [s],u [V],x [mm]\n", M.t, M.u, 0.0 * M.x + 2.5))
    assert "x [mm] (constant, 2.5 throughout)" in said
    said = refusal(capsys, table(tmp_path, "t [s],u [V],x [mm]\n", M.t, 0.0 * M.u, M.x))
    assert "no column looks like the drive" in said
    assert "u [V] (constant, 0 throughout)" in said


def test_files_of_different_columns(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = table(tmp_path, "t [s],u [V],x [mm]\n", M.t, M.u, M.x, name="a.csv")
    other = table(tmp_path, "t [s],force [N],x [mm]\n", M.t, M.u, M.x, name="b.csv")
    said = refusal(capsys, one, other, "--input", "u [V]")
    assert "b.csv: has no column 'u [V]'" in said
    assert "it has t [s], force [N], x [mm]" in said


def test_a_file_that_is_named_twice(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = table(tmp_path, "t [s],u [V],x [mm]\n", M.t, M.u, M.x)
    assert "is given twice" in refusal(capsys, path, path)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--input", "v:V"], ['no column "v"', "known: t [s], u [V], x [mm]"]),
        (["--input", "u:blorp"], ['unknown unit "blorp"']),
        (["--input", "u:mV"], ['the file states unit "V"', 'the manifest "mV"', "no manifest is written"]),
        (["--output", "displacment=x"], ['no signal "displacment"; did you mean "displacement"?']),
        (["--output", "x"], ["say which signal it is: --output displacement=x"]),
        (
            ["--output", "velocity=x"],
            ['column "x [mm]" is read in mm, as a displacement is: it cannot be the velocity'],
        ),
        (["--time", "tt"], ['--time tt: no column "tt"']),
        (["--time", "t:V"], ['"V" is not compatible with s']),
        (["--sample-rate", "-3"], ["--sample-rate -3: must be above 0 Hz"]),
        (["--sample-rate", "10", "--time", "t"], ["exclude each other"]),
        (["--hold", "zer"], ['did you mean "zero"?']),
        (["--plant", "oscilator"], ['did you mean "oscillator"?']),
        (["--test", "q.csv"], ["no such data file"]),
        (["--input", "x", "--output", "displacement=x"], ["is named for two signals"]),
    ],
)
def test_options_that_are_wrong(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], words: list[str]
) -> None:
    paths = [table(tmp_path, "t [s],u [V],x [mm]\n", M.t, M.u, M.x, name=name) for name in ("a.csv", "b.csv")]
    said = refusal(capsys, *paths, *options, "--no-plot")
    assert [word for word in words if word not in said] == []
    assert {one.name for one in tmp_path.iterdir()} == {"a.csv", "b.csv"}


def test_what_is_there_is_not_overwritten_without_force(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = table(tmp_path, "t [s],u [V],x [mm]\n", M.t, M.u, M.x)
    (tmp_path / "dataset.toml").write_text("mine")
    said = refusal(capsys, path, "--no-plot")
    assert f"{tmp_path / 'dataset.toml'}: is there already" in said
    assert "--force" in said
    assert (tmp_path / "dataset.toml").read_text() == "mine"
    assert main(["init", str(path), "--yes", "--no-plot", "--force", "--quiet"]) == 0
    assert rtctl.read_dataset(tmp_path / "dataset.toml").name == "r"


def test_the_columns_of_a_matrix_of_all_signals_are_offered(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    savemat(tmp_path / "r.mat", {"data": np.column_stack([M.t, M.u, M.x])})
    said = refusal(capsys, tmp_path / "r.mat")
    assert "taken so far: drive = data(:,2), time = data(:,1)" in said
    assert "--output 'displacement=data(:,3):UNIT' --input 'data(:,2):UNIT'" in said


def test_time_that_goes_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    t = np.where(np.arange(600) < 300, M.t, M.t - 0.1)
    path = table(tmp_path, "t [s],u [V],x [mm]\n", t, M.u, M.x)
    said = refusal(capsys, path, "--time", "t [s]")
    assert 'time column "t [s]" does not increase' in said


def test_a_reading_that_overflowed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    x = M.x.copy()
    x[5] = 9.9e37
    said = refusal(capsys, table(tmp_path, "t [s],u [V],x [mm]\n", M.t, M.u, x))
    assert "a reading overflowed" in said
    assert "no manifest is written" in said


def test_a_spectrum_is_no_record(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = table(tmp_path, "frequency [Hz],u [V],x [mm]\n", 1.0 + M.t, M.u, M.x)
    assert 'the column "frequency [Hz]" is a frequency: a spectrum is no record' in refusal(capsys, path)


def test_one_column_is_not_taken_for_both_roles(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = refusal(capsys, table(tmp_path, "t [s],heat [W],plate [degC]\n", M.t, M.u, M.x))
    assert "several columns" not in said
    assert 'only column "heat [W]" may be the drive' in said
    assert "no column of numbers is left that may be a motion" in said
    assert "--input 'heat [W]' --model MODEL.toml" in said


def test_an_example_has_two_columns_where_there_are_three(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = refusal(capsys, table(tmp_path, "t [s],ch1 [V],ch2 [V],ch3 [V]\n", M.t, M.u, M.x, M.v))
    assert "--input 'ch1 [V]' --output 'displacement=ch2 [V]'" in said


@pytest.mark.parametrize(
    ("head", "option", "words"),
    [
        (
            "# sample rate 1 kHz\nu [V],x [mm]\n",
            ("--sample-rate", "2000"),
            ["--sample-rate 2000: ", "1000 Hz (by line 1"],
        ),
        (
            "# fs = 1000 Hz\nTime/s,u [V],x [mm]\n",
            ("--time", "Time/s:ms"),
            ["--time Time/s:ms, which gives 1000000 Hz: ", "1000 Hz (by line 1"],
        ),
    ],
)
def test_a_rate_that_the_file_contradicts_is_refused_once_and_by_its_option(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], head: str, option: tuple[str, str], words: list[str]
) -> None:
    columns = (M.t, M.u, M.x) if "Time" in head else (M.u, M.x)
    said = refusal(capsys, table(tmp_path, head, *columns), *option)
    assert [word for word in words if word not in said] == []
    assert said.count("1000 Hz") == 1 + ("fs" in head)  # the line itself
    assert "manifest" not in said


def test_a_rate_of_one_of_several_samples_is_no_contradiction(tmp_path: Path) -> None:
    path = table(tmp_path, "# sample rate: 10 kHz\nu [V],x [mm]\n", M.u, M.x)
    assert rtctl.init(path, sample_rate_hz=1000.0, plot=False).dataset.records[0].period_s == 1e-3


def test_a_finding_about_every_record_is_printed_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    x = M.x.copy()
    x[5], x[-5] = 9.9e37, 9.9e37
    said = refusal(capsys, table(tmp_path, "t [s],u [V],x [mm]\n", M.t, M.u, x))
    assert len(set(said.splitlines())) == len(said.splitlines())
    assert "records.0" not in said


@pytest.mark.parametrize("said", ["b.csv", "last third"])
def test_a_test_record_that_one_file_does_not_have_is_refused_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], said: str
) -> None:
    path = table(tmp_path, "t [s],u [V],x [mm]\n", M.t, M.u, M.x, name="a.csv")
    assert f"--test {said}: no such data file" in refusal(capsys, path, "--test", said, "--no-plot")
    assert [one.name for one in tmp_path.iterdir()] == ["a.csv"]


def test_two_rates_in_one_file_are_told_with_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.savez(tmp_path / "r.npz", force_N=M.u, laser_mm=M.x[::4])
    said = refusal(capsys, tmp_path / "r.npz")
    assert "recorded at different rates" in said
    assert "resample the faster ones" in said


def test_a_release_without_a_drive_is_told_with_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = refusal(capsys, table(tmp_path, "t [s],angle [deg]\n", M.t, M.x))
    assert "release without any drive: say --input -" in said


def test_a_finding_of_all_records_of_a_file_is_told_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = table(tmp_path, "t [s],u [V],x [mm]\n", M.t, M.u, M.x)
    assert main(["init", str(path), "--yes", "--quiet", "--no-plot"]) == 0
    manifest = tmp_path / "dataset.toml"
    manifest.write_text(
        manifest.read_text(encoding="utf-8").replace('"x [mm]"', '"y [mm]"'), encoding="utf-8"
    )
    assert main(["preview", str(manifest)]) == 2
    said = capsys.readouterr().err
    assert said.count('no column "y [mm]"') == 1
    assert "(the same in 1 more record)" in said


def test_some_words_among_numbers_are_told_with_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = table(tmp_path, "t [s],u [V],x [mm]\n", M.t, M.u, M.x)
    lines = path.read_text().splitlines()
    lines[40] = ",".join([*lines[40].split(",")[:2], "OVLD"])
    path.write_text("\n".join(lines) + "\n")
    said = refusal(capsys, path)
    assert '"OVLD", in row 39' in said
    assert 'if "x [mm]" is a signal: empty its cells that are no numbers' in said


def test_the_example_keeps_what_was_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = table(tmp_path, "a,b,ch1 [mm],ch2 [mm]\n", M.t, M.u, M.x, M.v)
    said = refusal(capsys, path, "--time", "a:s", "--input", "b:V", "--hold", "zero")
    example = said.partition("for example: ")[2].strip()
    assert example.endswith("--time a:s --hold zero --input b:V --output 'displacement=ch1 [mm]'")
    said = refusal(capsys, path, "--time", "a:s", "--output", "displacement=ch1 [mm]")
    assert said.count("--input") == 2, "the option, and the example"
