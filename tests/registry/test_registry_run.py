"""Parts of a user in `rtctl run`: from a plugin file, as module:Class, from an installed distribution."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest
from heater_scenario import TEXT, run

import rtctl
from rtctl.border.mechanisms import plain_unit
from rtctl.cli import main
from rtctl.loop.live_parameters import units_of_parameters
from rtctl.registry import entries, find, load
from rtctl.scenario.schema import load_scenario

DIST_INFO = {
    "METADATA": "Metadata-Version: 2.1\nName: heater-parts\nVersion: 1.0\n",
    "entry_points.txt": (
        "[rtctl.plants]\nheater = heater_parts:Heater\n\n"
        "[rtctl.controllers]\nintegral = heater_parts:Integral\n"
    ),
}


def install(folder: Path, source: Path, files: dict[str, str] = DIST_INFO) -> None:
    """A distribution as pip leaves it, whose module registers nothing by itself."""
    text = re.sub(r"@rtctl.register\(.*\)\n", "", source.read_text())
    (folder / "heater_parts.py").write_text(text)
    info = folder / "heater_parts-1.0.dist-info"
    info.mkdir()
    for name, content in files.items():
        (info / name).write_text(content)


def test_a_plugin_brings_plant_and_controller(own_parts: Path, tmp_path: Path) -> None:
    code, summary = run(tmp_path, "--plugin", str(own_parts))
    assert code == 0
    assert summary is not None
    assert (summary["verdict"], summary["timing"]["steps"]) == ("pass", 1000)
    assert summary["tracking"]["unit"] == "K"
    assert 0.0 < summary["tracking"]["mean_abs_percent"] < 20.0
    assert summary["self_sensing"]["max_abs"] < 1e-5  # the reading is the output, both as float32


def test_without_the_plugin_the_plant_is_unknown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, summary = run(tmp_path)
    message = capsys.readouterr().err
    assert (code, summary) == (2, None)
    assert 'key "scenario.plant": unknown plant "heater"' in message
    assert "Traceback" not in message


def test_an_own_estimator_takes_its_options(own_parts: Path, tmp_path: Path) -> None:
    settings = ["--set", "estimator.kind=smoothed", "--set", "estimator.time_constant_s=0.02"]
    code, summary = run(tmp_path, "--plugin", str(own_parts), *settings)
    assert code == 0
    assert summary is not None
    assert summary["estimator"] == "smoothed"
    assert summary["self_sensing"]["max_abs"] > 0.1  # it lags


def test_a_plant_file_sets_the_options_of_an_own_plant(own_parts: Path, tmp_path: Path) -> None:
    (tmp_path / "hot.toml").write_text('[plant]\nkind = "heater"\ngain = 8.0\n')
    plain = run(tmp_path, "--plugin", str(own_parts))[1]
    hot = run(tmp_path, "--plugin", str(own_parts), "--set", "driver.device=hot.toml")[1]
    assert plain is not None
    assert hot is not None
    assert hot["tracking"]["mean_abs"] < 0.9 * plain["tracking"]["mean_abs"]  # twice the gain of the loop


def test_module_and_class_beside_the_scenario_need_no_registration(own_parts: Path, tmp_path: Path) -> None:
    source = re.sub(r"@rtctl.register\(.*\)\n", "", own_parts.read_text())
    (tmp_path / "parts_beside.py").write_text(source)
    text = (
        TEXT.replace('plant = "heater"', 'plant = "parts_beside:Heater"')
        .replace('device = "heater"', 'device = "parts_beside:Heater"')
        .replace('kind = "integral"', 'kind = "parts_beside:Integral"\nrate = 6.0')
    )
    code, summary = run(tmp_path, text=text)
    assert code == 0
    assert summary is not None
    assert summary["verdict"] == "pass"


def test_entry_points_of_a_distribution_are_found(
    own_parts: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site = tmp_path / "site"
    site.mkdir()
    install(site, own_parts)
    monkeypatch.syspath_prepend(str(site))
    (entry,) = [entry for entry in entries("controller") if entry.is_own]
    assert (entry.name, entry.origin, entry.value) == ("integral", "heater-parts", "heater_parts:Integral")
    code, summary = run(tmp_path)
    assert code == 0
    assert summary is not None
    assert summary["verdict"] == "pass"


def test_an_entry_point_that_does_not_import_is_named_when_it_is_used(
    own_parts: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site = tmp_path / "site"
    site.mkdir()
    install(site, own_parts)
    (site / "heater_parts.py").write_text("import no_such_library\n")
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.delitem(__import__("sys").modules, "heater_parts", raising=False)
    with pytest.raises(rtctl.border.errors.InputError, match=r"heater-parts: .*no_such_library"):
        load(find("controller", "integral"))


def test_the_list_marks_own_parts(
    own_parts: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copied = tmp_path / "mine.py"
    shutil.copy(own_parts, copied)
    assert main(["list", "--json", "--plugin", str(copied)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert list(found) == ["scenarios", "plants", "drivers", "estimators", "controllers", "mechanisms"]
    own = {sort: [row["name"] for row in rows if row["own"]] for sort, rows in found.items()}
    assert own == {
        "scenarios": [], "plants": ["heater"], "drivers": [], "estimators": ["smoothed"],
        "controllers": ["integral"], "mechanisms": [],
    }  # fmt: skip
    (row,) = [row for row in found["controllers"] if row["own"]]
    assert (row["summary"], row["origin"]) == ("integral of the error", str(copied))
    assert {"steps", "acquire_vo2"} <= {row["name"] for row in found["scenarios"]}
    assert {"friction.coulomb", "heater.tcr"} <= {row["name"] for row in found["mechanisms"]}
    assert main(["list", "controllers", "--plugin", str(copied)]) == 0
    head, _, rows = capsys.readouterr().out.partition(
        "your own, from"
    )  # a wide table goes on in blocks below
    begin, lines = len(head.splitlines()[-1]), rows.splitlines()
    assert str(copied) in "".join(line[begin:].strip() for line in lines)  # folded, not cut
    assert main(["list", "controlers"]) == 2
    assert 'did you mean "controllers"?' in capsys.readouterr().err


PID = TEXT.replace('kind = "integral"', 'kind = "pid"')


def test_a_pid_with_gains_by_hand_controls_a_plant_without_a_model(own_parts: Path, tmp_path: Path) -> None:
    gains = ["--set", "controller.kp=0.02 V/K", "--set", "controller.ki=2000 mV/(K*s)"]
    code, summary = run(tmp_path, "--plugin", str(own_parts), *gains, text=PID)
    assert code == 0
    assert summary is not None
    assert (summary["verdict"], summary["tracking"]["unit"]) == ("pass", "K")
    assert summary["step_response"]["settled_error"]["max"] < 0.2
    scenario, _ = load_scenario(tmp_path / "heater.toml", ["controller.kp=0.02 V/K", "controller.ki=2 V/K/s"])
    assert {plain_unit(one) for one in units_of_parameters(scenario.profile, is_played=False).values()} == {
        "K", "V/K", "V/(K*s)", "V*s/K",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ([], ['a "heater" has no model to tune a PID on; give kp [V/K] and ki [V/K/s]']),
        (["controller.kp=1 mA/um", "controller.ki=1 V/K/s"], ["controller.kp", "mA/um", "V/K"]),
        (
            ["controller.kp=1 V/K", "controller.ki=-1 V/K/s"],
            ["[controller]: PID gains must be", "of one sign"],
        ),
        (
            ["controller.kind=pi", "controller.kp=1 V/K", "controller.ki=1 V/(K*s)"],
            ['rtctl has no controller for a "heater" but "pid" with kp [V/K] and ki [V/K/s]'],
        ),
    ],
)
def test_gains_are_asked_for_in_the_units_of_the_plants_own_signals(
    settings: list[str],
    words: list[str],
    own_parts: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    options = [word for setting in settings for word in ("--set", setting)]
    code, _ = run(tmp_path, "--plugin", str(own_parts), *options, text=PID)
    message = capsys.readouterr().err
    assert code == 2
    for word in words:
        assert word in message
