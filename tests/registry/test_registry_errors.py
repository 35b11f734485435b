"""What is wrong with a part of a user is one InputError that names it; inside the loop, one RunError."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from heater_scenario import TEXT, run

import rtctl
from rtctl.border.errors import InputError
from rtctl.border.records import device_profile
from rtctl.interfaces import ControlAction, Controller
from rtctl.registry import PlantKind, find, load_plugin


class Whole:
    """A controller with all methods."""

    terms = (("term", "V"),)
    preview_s = 0.0

    def start(self, levels: Any, setpoint: float, estimate: Any) -> None: ...

    def step(self, setpoint: float, upcoming: float, estimate: Any, elapsed_s: float) -> ControlAction:
        return ControlAction((0.0,), (0.0,))

    def applied(self, levels: Any) -> None: ...


class Lacking:
    def start(self, levels: Any, setpoint: float, estimate: Any) -> None: ...

    def step(self, setpoint: float, upcoming: float, estimate: Any, elapsed_s: float) -> None: ...


class OtherArguments(Whole):
    def step(self, setpoint: float) -> ControlAction:  # type: ignore[override]
        return ControlAction((0.0,), (0.0,))


class Fails(Whole):
    def step(self, setpoint: float, upcoming: float, estimate: Any, elapsed_s: float) -> ControlAction:
        return {"levels": 1.0}["level"]  # type: ignore[return-value]


class FailsLater(Whole):
    def __init__(self) -> None:
        self.left = 21  # some steps are tried before the device is opened

    def step(self, setpoint: float, upcoming: float, estimate: Any, elapsed_s: float) -> ControlAction:
        self.left -= 1
        return ControlAction((1.0 / (self.left and 1),), (0.0,))


class ReturnsNumber(Whole):
    def step(self, setpoint: float, upcoming: float, estimate: Any, elapsed_s: float) -> ControlAction:
        return 1.0  # type: ignore[return-value]


class TwoLevels(Whole):
    def step(self, setpoint: float, upcoming: float, estimate: Any, elapsed_s: float) -> ControlAction:
        return ControlAction((0.0, 1.0), (0.0,))


class Without:
    """A plant without a profile."""

    def reset(self) -> None: ...

    def advance(self, levels: Any, dt_s: float) -> None: ...

    def measure(self) -> Any: ...

    def step(self, levels: Any, dt_s: float) -> Any: ...


PROFILE = device_profile("other", commands={"u": "V"}, sensed={"y": "V"}, reference=("x", "V"))


@pytest.mark.parametrize(
    ("part", "name", "value", "words"),
    [
        ("controler", "mine", Whole, 'there is no part "controler"; did you mean "controller"?'),
        ("controller", "", Whole, 'a controller needs a name without ":", got \'\''),
        ("controller", "a:b", Whole, 'a controller needs a name without ":"'),
        ("controller", "pi", Whole, 'controller "pi": the name is taken by a part of rtctl'),
        ("estimator", "observer", Whole, 'estimator "observer": the name is taken'),
        ("driver", "serial", Whole, 'driver "serial": the name is taken'),
        ("plant", "vo2", Whole, 'plant "vo2": the name is taken'),
        ("controller", "mine", Lacking, 'controller "mine": Lacking lacks the method applied(levels)'),
        (
            "controller", "mine", OtherArguments,
            "OtherArguments.step must take (setpoint, upcoming, estimate, elapsed_s), it takes (setpoint)",
        ),
        ("estimator", "mine", Whole, "Whole.start must take (levels, sensed)"),
        ("driver", "mine", Whole, "Whole lacks the method open(lockstep_period_us, watchdog_ms, timeout_s)"),
        ("controller", "mine", 3, "a class, or a function that returns its objects, is needed, not 3"),
        ("plant", "mine", Without, 'plant "mine": Without lacks the class attribute profile'),
        ("plant", "mine", type("P", (Without,), {"profile": PROFILE}), 'its profile is of kind "other"'),
        ("plant", "mine", PlantKind(name="other", profile=PROFILE), 'the PlantKind has the name "other"'),
        ("mechanism", "a.b", Whole, 'mechanism "a.b": a Mechanism is needed'),
    ],
    ids=lambda value: value if isinstance(value, str) and " " not in value else "",
)  # fmt: skip
def test_a_wrong_part_is_refused_when_it_is_registered(part: Any, name: str, value: Any, words: str) -> None:
    with pytest.raises(InputError) as raised:
        rtctl.register(part, name, value)
    assert words in str(raised.value)
    assert raised.value.exit_code == 2


def test_a_name_that_another_part_of_the_user_has_is_refused_and_the_same_class_is_not() -> None:
    rtctl.register("controller", "mine", Whole)
    rtctl.register("controller", "mine", Whole)
    with pytest.raises(
        InputError, match=r'controller "mine": the name is taken by one of .*test_registry_errors'
    ):
        rtctl.register("controller", "mine", Fails)


def test_a_decorator_returns_the_class() -> None:
    decorated: type[Controller] = rtctl.register("controller", "mine", summary="all of it")(Whole)
    assert decorated is Whole
    assert find("controller", "mine").summary == "all of it"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "there is no such file"),
        ("import no_such_library\n", "ModuleNotFoundError: No module named 'no_such_library' (line 1"),
        ("x = 1\ny = {}['key']\n", "does not import: KeyError: 'key' (line 2)"),
        ("def f(:\n", "does not import: SyntaxError"),
        ("import rtctl\nrtctl.register('controller', 'pi', print)\n", 'controller "pi": the name is taken'),
    ],
    ids=["missing", "import", "key error", "syntax", "taken"],
)  # fmt: skip
def test_a_plugin_that_does_not_import_is_named(
    text: str | None, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mine.py"
    if text is not None:
        path.write_text(text)
    code, summary = run(tmp_path, "--plugin", str(path))
    message = capsys.readouterr().err
    assert (code, summary) == (2, None)
    assert f"rtctl run: --plugin {path}: " in message
    assert words in message
    assert "Traceback" not in message


def test_a_plugin_is_a_python_file(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("")
    with pytest.raises(InputError, match=r"--plugin .*mine.txt: a Python file"):
        load_plugin(tmp_path / "mine.txt")


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["controller.rate=-1"], ['controller "integral" of', "with rate = -1: rate must be > 0 V/(K*s), got -1"]),
        (["controller.rte=1"], ['unknown key "controller.rte" of controller "integral"; did you mean "rate"?']),
        (["controller.kind=integrl"], ['key "controller.kind": unknown kind "integrl"; did you mean "integral"?']),
        (["estimator.kind=smothed"], ['key "estimator.kind": unknown kind "smothed"; did you mean "smoothed"?']),
        (["estimator.kind=observer"], ['"observer" does not estimate a "heater"', "none"]),
        (["controller.kind=pi"], ['rtctl has no controller for a "heater"']),
        (["driver.device=vo2_a"], ['driver.device = "vo2_a" is a "vo2", the scenario drives a "heater"']),
        (["driver.device=heatr"], ['no bundled plant "heatr"']),
        (["estimator.kind=no_such:Thing"], ['key "estimator.kind": "no_such:Thing": there is no module "no_such"']),
        (["estimator.kind=math:Thing"], ['key "estimator.kind": "math" has no "Thing"']),
        (["estimator.kind=json:JSONEncoder"], ["JSONEncoder lacks the method start(levels, sensed)"]),
        (["limits.sensed_high=3 um"], ["limits.sensed_high", "um", "K"]),
        (["scenario.model=heater.toml"], ['a "heater" has no models']),
    ],
    ids=lambda value: value[0] if isinstance(value, list) and "=" in value[0] else "",
)  # fmt: skip
def test_a_wrong_option_of_an_own_part_is_named(
    settings: list[str], words: list[str], own_parts: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = [word for setting in settings for word in ("--set", setting)]
    code, summary = run(tmp_path, "--plugin", str(own_parts), *options)
    message = capsys.readouterr().err
    assert (code, summary) == (2, None), message
    assert [word for word in words if word not in message] == [], message
    assert "Traceback" not in message


def test_a_plant_file_with_a_wrong_option_is_named(
    own_parts: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "hot.toml").write_text('[plant]\nkind = "heater"\ntime_constant_s = 0.0\n')
    code, _ = run(tmp_path, "--plugin", str(own_parts), "--set", "driver.device=hot.toml")
    message = capsys.readouterr().err
    assert code == 2
    assert 'hot.toml: plant "heater"' in message
    assert "time_constant_s must be > 0 s, got 0.0" in message


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (Fails, "controller \"mine\": step raised KeyError: 'level'"),
        (ReturnsNumber, 'controller "mine": step must return a ControlAction(levels, terms), got 1.0'),
        (TwoLevels, 'controller "mine": step must return 1 levels and 1 terms, got'),
    ],
)
def test_what_an_own_controller_raises_ends_the_run_with_its_name(
    value: type, words: str, own_parts: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rtctl.register("controller", "mine", value)
    code, summary = run(tmp_path, "--plugin", str(own_parts), text=TEXT.replace('"integral"', '"mine"'))
    message = capsys.readouterr().err
    assert code == 1
    assert words in message
    assert "Traceback" not in message
    assert summary is None  # it was tried before the device was opened


def test_an_own_controller_that_fails_later_ends_the_run_as_any_fault_does(
    own_parts: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rtctl.register("controller", "mine", FailsLater)
    code, summary = run(tmp_path, "--plugin", str(own_parts), text=TEXT.replace('"integral"', '"mine"'))
    assert code == 1
    assert 'controller "mine": step raised ZeroDivisionError' in capsys.readouterr().err
    assert summary is not None
    assert [one["fault"] for one in summary["faults"]] == ["part_failed"]
    assert 10 < summary["timing"]["steps"] < 20  # recorded and summed up


def test_a_part_for_other_kinds_of_plant_is_refused(
    own_parts: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rtctl.register("controller", "mine", Whole, plants="vo2")
    code, _ = run(tmp_path, "--plugin", str(own_parts), text=TEXT.replace('"integral"', '"mine"'))
    assert code == 2
    assert '"mine" is registered for vo2, not for a "heater"' in capsys.readouterr().err
