"""Bad input is one message that names file, key or port and what to do; exit 2, no traceback, nothing written."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from wire_cases import settings

from rtctl.cli import main

HEAD = '[scenario]\ntitle = "x"\nduration = "0.05 s"\n'
REFERENCE = '[reference]\nkind = "steps"\nhold = "10 ms"\nlevels = ["50 %"]\n'
EXCITATION = '[[excitation]]\nkind = "levels"\nhold = "10 ms"\nlevels = ["50 %"]\n'
TCP = "driver.kind=modbus-tcp"
RTU = "driver.kind=modbus-rtu"


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The message of a command that must end with exit code 2 before it has written anything."""
    assert main(list(arguments)) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(f"rtctl {arguments[0]}: ")
    assert "Traceback" not in said.err
    return said.err


def scenario_file(folder: Path, text: str = HEAD + REFERENCE) -> str:
    path = folder / "mine.toml"
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["scenario.perod=1 ms"], ['unknown key "scenario.perod"; did you mean "period"?']),
        (["driver.devise=vo2_a"], ['unknown key "driver.devise"; did you mean "device"?']),
        (["reference.levelz=3"], ['unknown key "reference.levelz"; did you mean "levels"?']),
        (["refrence.kind=steps"], ['unknown key "refrence"; did you mean "reference"?']),
        (["scenario.period=1 V"], ['key "scenario.period"', '"V" is not compatible with s']),
        (["scenario.period=1 sekunde"], ['key "scenario.period"', 'unknown unit "sekunde"']),
        (["scenario.period=1"], ['key "scenario.period": 1 has no unit; write "1 s"']),
        (['reference.levels=["5"]'], ['key "reference.levels.0"', 'write "5 um"']),
        (["scenario.period=abc"], ['key "scenario.period"', '"<number> <unit>"']),
        (["scenario.period=inf s"], ['key "scenario.period"', "finite"]),
        (["scenario.period=0 s"], ['key "scenario.period"', "greater than 0"]),
        (["scenario.period=1.5 us"], ["period = 1.5 us must be whole microseconds"]),
        (["scenario.duration=0.4 ms"], ["duration = 0.0004 s is shorter than the period 0.001 s"]),
        (["limits.low=9 mA"], ["low = 9 mA must be below high = 8.49 mA"]),
        (["limits.safe=9 mA"], ["safe = 9 mA must not exceed high = 8.49 mA"]),
        (["limits.safe=8.4 mA"], ["limits.safe = 8.4 mA", "lower it"]),
        (["limits.low=8.4 mA"], ["limits.low = 8.4 mA", "leave nothing of the range"]),
        (["limits.sensed_low=11 Mohm"], ["sensed_low = 1.1e+07 ohm must be below sensed_high = 1e+07 ohm"]),
        (['reference.levels=["200 %"]'], ["[reference] asks for", "the model reaches"]),
        (['reference.levels=["-1 um"]'], ["[reference] asks for -1 to -1 um"]),
        (['reference.levels=["nan %"]'], ["finite"]),
        (["reference.kind=stepz"], ['key "reference.kind": unknown kind "stepz"; known: steps, multisine']),
        (["estimator.kind=observr"], ['key "estimator.kind": unknown kind "observr"', "observer"]),
        (["controller.kp=1 mA/um"], ["kp and ki are set together"]),
        (["controller.phase_margin=100 deg"], ["controller.phase_margin = 100 deg", "out of a PI's reach"]),
        (["controller.deadband=-1 %"], ["deadband"]),
        (["clock.watchdog=100 s"], ["watchdog = 100000 ms must be 0 (none) or 1 to 65535 ms"]),
        (["driver.device=vo2_x"], ['no bundled plant "vo2_x"', "vo2_"]),
        (["driver.device=other.toml"], ["other.toml: no such plant file"]),
        (["driver.seed=-1"], ['key "driver.seed"']),
        ([TCP], ['key "driver.address" is missing']),
        ([TCP, "driver.address=127.0.0.1"], ['key "driver.address"', "HOST:PORT"]),
        ([TCP, "driver.address=127.0.0.1:99999"], ['key "driver.address"', "above 65535"]),
        ([TCP, "driver.address=a..b:5"], ['key "driver.address"', "HOST:PORT"]),
        ([TCP, "driver.address=127.0.0.1:1"], ["modbus-tcp 127.0.0.1:1", "nothing listens there"]),
        ([RTU, "driver.port=/nowhere/tty7"], ["modbus-rtu /nowhere/tty7", "no such port"]),
        (["driver.kind=modbus-tpc"], ['unknown kind "modbus-tpc"', "modbus-tcp"]),
        (["duration"], ["--set duration: expected KEY=VALUE"]),
        (["=3"], ["--set =3: expected KEY=VALUE"]),
        (["a..b=3"], ["--set a..b=3: expected KEY=VALUE"]),
        (["scenario.title.x=3"], ["--set scenario.title.x=3", '"title" is not a table']),
        (["excitation.3.seed=1"], ['"excitation"']),
        (["driver=3"], ['key "driver"']),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) and "=" in "".join(value) else "",
)  # fmt: skip
def test_a_wrong_value_of_a_scenario_is_named_with_its_key(
    overrides: list[str], words: list[str], model_file: Path, tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    out = tmp_path / "out"
    run = ["run", scenario_file(tmp_path), "--model", str(model_file), "--out", str(out), "--quiet"]
    message = refusal(capsys, *run, *settings(*overrides))
    assert [word for word in words if word not in message] == []
    assert message.count("\n") == 1, "one finding, one line"
    assert not out.exists()


def test_all_findings_come_at_once_each_with_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = scenario_file(tmp_path)
    wrong = settings("scenario.perod=1 ms", "limits.low=9 mA", "estimator.kind=x")
    lines = refusal(capsys, "run", file, *wrong).splitlines()
    assert len(lines) == 3
    assert all(f"{file}: " in line for line in lines)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEAD, ["either a [reference] to track or [[excitation]] tables to play"]),
        (HEAD + REFERENCE + EXCITATION, ["either a [reference] to track or [[excitation]] tables to play"]),
        ('[scenario]\ntitle = "x"\n' + REFERENCE, ['key "scenario.duration" is missing']),
        (REFERENCE, ['key "scenario" is missing']),
        (HEAD + REFERENCE.replace('kind = "steps"', ""), ['key "reference.kind" is missing']),
        (HEAD + '[scenario]\ntitle = "y"\n', ["not valid TOML"]),
        ('[scenario]\ntitle = "x"\n' + EXCITATION.replace("10 ms", "0.1 ms"), ["excitation.hold", "shorter"]),
        (
            '[scenario]\ntitle = "x"\n' + EXCITATION.replace("50 %", "101 %"),
            ["excitation 0 asks for", "[limits]"],
        ),
    ],
)
def test_a_file_that_is_no_scenario_is_refused(
    text: str, words: list[str], model_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    message = refusal(
        capsys, "run", scenario_file(tmp_path, text), "--model", str(model_file), "--out", str(out)
    )
    assert [word for word in words if word not in message] == []
    assert not out.exists()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("sine_01hz", ['did you mean "sine_0p1hz"?']),
        ("nothing_like_it", ["no such scenario file; known: acquire_oscillator, acquire_vo2,"]),
        ("missing.toml", ["missing.toml: no such scenario file"]),
        (".", ["no such scenario file"]),
    ],
)
def test_a_scenario_that_is_not_there(
    name: str, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    message = refusal(capsys, "run", name)
    assert [word for word in words if word not in message] == []


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, ["no such file"]),
        (b"x = [", ["not valid TOML"]),
        (b"\xff\xfe\x00", ["not valid TOML"]),
        (b"[other]\n", ["table [model] is missing", "rtctl identify"]),
        (b'[model]\nkind = "oscillator"\n', ["model.kind", "oscillator", "vo2"]),
        (b'[model]\nkind = "vo2"\n', ["parameters", "rtctl identify"]),
    ],
)
def test_a_model_that_cannot_be_used(
    content: bytes | None, words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "model.toml"
    if content is not None:
        model.write_bytes(content)
    message = refusal(capsys, "run", "steps", "--model", str(model), "--out", str(tmp_path / "out"))
    assert [word for word in (str(model), *words) if word not in message] == []
    assert not (tmp_path / "out").exists()


def test_a_model_that_was_cut_off_is_refused(
    model_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "model.toml"
    lines = model_file.read_text(encoding="utf-8").splitlines()
    model.write_text("\n".join(lines[: len(lines) // 2]), encoding="utf-8")
    message = refusal(capsys, "run", "steps", "--model", str(model), "--out", str(tmp_path / "out"))
    assert str(model) in message
    assert not (tmp_path / "out").exists()


def test_a_folder_where_a_model_should_be(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "is a folder" in refusal(capsys, "run", "steps", "--model", str(tmp_path))


@pytest.mark.parametrize(
    "command",
    [["run", "steps"], ["acquire", "acquire_vo2"], ["demo"], ["identify", "x.toml", "--kind", "vo2"]],
)
def test_a_place_where_nothing_can_be_written_is_known_before_anything_moves(
    command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("mine")
    message = refusal(capsys, *command, "--out", str(tmp_path / "file" / "deeper"))
    assert f"{tmp_path / 'file'} is a file, a folder is needed" in message
    assert (tmp_path / "file").read_text() == "mine"


def test_acquiring_a_scenario_without_excitation(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert "[[excitation]]" in refusal(capsys, "acquire", scenario_file(tmp_path), "--out", str(out))
    assert not out.exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], ["VERB"]),
        (["rum"], ["'rum'", "'run'", "'acquire'", 'did you mean "run"?']),
        (["diagnos"], ['did you mean "diagnose"?']),
        (["completion", "zs"], ["'zs'", 'did you mean "zsh"?']),
        (["preview", "x.toml", "--jason"], ["rtctl preview: ", "--jason", 'did you mean "--json"?']),
        (["list", "plants", "more"], ["rtctl list: unrecognized arguments: more\n"]),
        (["run"], ["scenario"]),
        (["identify", "x.toml"], ["--out"]),
        (["serve", "vo2_a"], ["--modbus-rtu", "--modbus-tcp"]),
    ],
)
def test_wrong_usage_is_exit_2_with_the_usage(
    arguments: list[str], words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    message = capsys.readouterr().err
    assert ended.value.code == 2
    assert [word for word in ("usage: rtctl", *words) if word not in message] == []


@pytest.mark.parametrize(
    ("option", "value", "limits"), [("plays", "0", "1 to 64"), ("cells", "200", "8 to 80")]
)
def test_sizes_of_an_identification_have_limits(
    option: str, value: str, limits: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = ["x.toml", "--kind", "vo2", "--out", str(tmp_path / "m.toml")]
    assert main(["identify", *files, f"--{option}", value]) == 2
    assert f"{option} {value}: {limits}" in capsys.readouterr().err


def test_a_kind_of_plant_that_nothing_identifies(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    message = refusal(capsys, "identify", "x.toml", "--out", str(tmp_path / "m.toml"), "--kind", "vo3")
    assert 'nothing identifies a "vo3"; did you mean "vo2"?' in message


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--kind", "oscillator", "--plays", "3"], "plays 3: no option of kind"),
        (["--kind", "vo2", "--model", "m.toml"], "a vo2 is identified from its data alone"),
        (["--kind", "vo2", "--seed", "-1"], "seed -1: 0 to"),
    ],
)
def test_options_that_do_not_belong_to_the_kind_are_refused_before_data_are_read(
    options: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert words in refusal(capsys, "identify", "x.toml", "--out", str(tmp_path / "out.toml"), *options)


def test_the_real_command_line_says_the_same(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "rtctl", "run", "stepz", "--out", str(tmp_path / "out")]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert ended.stdout == ""
    assert ended.stderr == 'rtctl run: stepz: no such scenario file; did you mean "steps"?\n'


DATASET = '[dataset]\nname = "n"\nplant = "oscillator"\n'
MODEL = '[model]\nkind = "oscillator"\n[model.parameters]\n'
IN_A_MANIFESTS_PLACE = "is a model file (model.toml), the manifest of a dataset (dataset.toml) is needed here"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["simulate", "d.toml", "m.toml", "--out", "o"], f"m.toml: {IN_A_MANIFESTS_PLACE}"),
        (["diagnose", "m.toml", "--model", "d.toml", "--out", "o"], f"m.toml: {IN_A_MANIFESTS_PLACE}"),
        (["identify", "m.toml", "--out", "o.toml"], f"m.toml: {IN_A_MANIFESTS_PLACE}"),
        (["preview", "m.toml"], f"m.toml: {IN_A_MANIFESTS_PLACE}"),
        (["identify", "r.json", "--out", "o.toml"], "r.json: is no TOML file, as a manifest (dataset.toml)"),
        (["preview", "s.toml"], "s.toml: is a scenario, the manifest of a dataset"),
        (["run", "d.toml", "--out", "o"], "d.toml: is the manifest of a dataset (dataset.toml), a scenario is needed"),
        (["run", "s.toml", "--model", "d.toml", "--out", "o"], "a model file (model.toml) is needed here"),
    ],
)  # fmt: skip
def test_a_file_in_the_place_of_another_is_told_in_one_line(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("d.toml").write_text(DATASET)
    Path("m.toml").write_text(MODEL)
    Path("s.toml").write_text(HEAD + REFERENCE)
    Path("r.json").write_text('{"current": [1, 2]}')
    message = refusal(capsys, *arguments)
    assert words in message
    assert len(message.splitlines()) == 1
    assert not Path("o").exists()


@pytest.mark.parametrize(("names", "words"), [
    (["model.toml", "dataset.toml"], "; did you mean here/dataset.toml, here/model.toml?"),
    ([], "a TOML file is needed, and it holds none"),
])  # fmt: skip
def test_a_folder_in_the_place_of_a_manifest_tells_what_it_holds(
    names: list[str],
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("here").mkdir()
    for name in names:
        Path("here", name).write_text(DATASET)
    assert words in refusal(capsys, "preview", "here")


@pytest.mark.parametrize("where", ["127.0.0.1:80000", "localhost:65536"])
def test_a_port_that_is_too_large_is_told_with_its_limit(
    where: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    port = where.rpartition(":")[2]
    told = f"port {port} is above 65535"
    assert told in refusal(capsys, "serve", "vo2_a", "--modbus-tcp", where)
    words = ["--out", str(tmp_path / "o"), *settings(TCP, f"driver.address={where}")]
    assert f"port {port} of '{where}' is above 65535" in refusal(
        capsys, "run", scenario_file(tmp_path), *words
    )


def test_a_dead_address_is_told_before_the_schedule(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--out", str(tmp_path / "o"), *settings(TCP, "driver.address=127.0.0.1:9", "clock.mode=live")]
    message = refusal(capsys, "acquire", scenario_file(tmp_path, HEAD + EXCITATION), *words)
    assert "nothing listens there" in message
