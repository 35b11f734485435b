"""A device as a Python class: the same answers as from expressions, in every part of the program that takes a model."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import own_devices
import pytest

import rtctl
from rtctl import Dataset, InputError, Record

UNITS = {"pump": "V", "reading": "V"}


@pytest.fixture
def tanks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Path]:
    """Model files of the tanks: by a class, and by expressions."""
    monkeypatch.setattr(sys, "path", [*sys.path, str(Path(__file__).parent)])
    own, written = tmp_path / "own.toml", tmp_path / "written.toml"
    own.write_text('[model]\nkind = "equations"\npython = "own_devices:Tanks"\n', encoding="utf-8")
    written.write_text(own_devices.TANKS, encoding="utf-8")
    return own, written


def recorded(folder: Path, y: np.ndarray | None = None) -> Dataset:
    u = 3.0 + np.repeat(np.random.default_rng(3).uniform(-2.0, 2.0, 12), 10)
    signals = {"pump": u, "reading": np.zeros(120) if y is None else y}
    return rtctl.write_dataset(
        folder, [Record(name="one", period_s=4.0, signals=signals)], name="tanks", plant="equations",
        units=UNITS, holds={"pump": "zero"},
    )  # fmt: skip


def simulated(model: object, data: Dataset, output: str = "reading") -> np.ndarray:
    return rtctl.simulate(model, data).records["one"].simulated[output]  # type: ignore[arg-type]


def test_a_class_moves_as_the_same_equations_do(tanks: tuple[Path, Path], tmp_path: Path) -> None:
    data = recorded(tmp_path / "data")
    own, written = (simulated(model, data) for model in tanks)
    assert np.ptp(written) > 0.05
    np.testing.assert_allclose(own, written, rtol=1e-10)
    np.testing.assert_array_equal(simulated(rtctl.read_model(own_devices.Tanks), data), own)


def test_mechanisms_act_on_a_class_and_are_written_into_its_file(
    tanks: tuple[Path, Path], tmp_path: Path
) -> None:
    acting = (
        '[[model.mechanisms]]\nid = "state.lower.friction"\n'
        'parameters = { level = { value = 0.005, unit = "cm/s" } }\n'
        '[[model.mechanisms]]\nid = "parameter.hole.drift"\n'
        'parameters = { rate = { value = -2e-3, unit = "1/s" } }\n'
        '[[model.mechanisms]]\nid = "input.pump.lag"\n'
        'parameters = { time_constant = { value = 5.0, unit = "s" } }\n'
    )
    data = recorded(tmp_path / "data")
    plain = simulated(tanks[0], data)
    for one in tanks:
        one.write_text(one.read_text(encoding="utf-8") + acting, encoding="utf-8")
    own, written = (simulated(model, data) for model in tanks)
    assert np.abs(own - plain).max() > 0.1
    np.testing.assert_allclose(own, written, rtol=1e-8)


def test_its_parameters_are_identified_and_the_written_file_is_a_model(
    tanks: tuple[Path, Path], tmp_path: Path
) -> None:
    data = recorded(tmp_path / "data", simulated(tanks[1], recorded(tmp_path / "blank")))
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(
        tanks[0].read_text(encoding="utf-8") + "[model.parameters]\noutlet = { value = 1.3e-3 }\n"
        "hole = { fixed = true }\ngain = { fixed = true }\n",
        encoding="utf-8",
    )
    assert np.abs(simulated(wrong, data) - data.records[0].signals["reading"]).max() > 0.05
    fit = rtctl.identify(data, model=wrong)
    assert fit.parameters["outlet"].value == pytest.approx(1.0e-3, rel=1e-5)
    fit.save(tmp_path / "fitted.toml")
    np.testing.assert_allclose(
        simulated(tmp_path / "fitted.toml", data), data.records[0].signals["reading"], atol=1e-5
    )


def test_a_stiff_class_takes_implicit_steps_and_reads_arrays_of_its_module(tmp_path: Path) -> None:
    u = np.repeat([1.0, -2.0, 0.5], 20)
    data = rtctl.write_dataset(
        tmp_path / "data", [Record(name="one", period_s=0.05, signals={"u": u, "y": np.zeros(60)})],
        name="fast", plant="equations", units={"u": "V", "y": "V"}, holds={"u": "zero"},
    )  # fmt: skip
    file = tmp_path / "fast.toml"
    file.write_text(own_devices.FAST, encoding="utf-8")
    own = simulated(rtctl.read_model(own_devices.Fast), data, "y")
    np.testing.assert_allclose(own, simulated(file, data, "y"), atol=1e-9)


def test_a_changed_constant_of_the_module_is_not_taken_from_the_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = recorded(tmp_path / "data")
    before = simulated(rtctl.read_model(own_devices.Tanks), data)
    monkeypatch.setattr(own_devices, "GRAVITY", 1.3 * own_devices.GRAVITY)
    assert np.abs(simulated(rtctl.read_model(own_devices.Tanks), data) - before).max() > 0.05


@pytest.mark.slow
def test_a_class_is_a_device_and_a_loop_controls_it(tanks: tuple[Path, Path]) -> None:
    tables = {
        "scenario": {
            "title": "tanks", "plant": "equations", "model": str(tanks[0]), "period": "1 s",
            "duration": "300 s",
        },
        "limits": {"low": "0 V", "high": "8 V", "sensed_low": "-1 V", "sensed_high": "10 V"},
        "reference": {"kind": "steps", "levels": ["0.8 V"], "hold": "300 s"},
        "estimator": {"kind": "kalman"},
    }  # fmt: skip
    run = rtctl.run(tables)
    assert run.fault is None
    assert run.signals["reading"][-20:].mean() == pytest.approx(0.8, abs=0.02)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("WithSelf", 'WithSelf.rates: it takes "self", but it is a plain function of numbers'),
        (
            "Misspelt",
            'the argument "pmup" is no state, input or parameter, nor the time t; did you mean "pump"',
        ),
        ("TooFew", "TooFew.rates must return 2 numbers: upper, lower"),
        ("NotCompiled", "NotCompiled.rates does not compile: "),
        ("WithDefault", "the argument pump must be a plain name, without a default"),
        ("WithoutRates", "has no function rates(...)"),
    ],
)
def test_what_is_wrong_with_a_class_is_said(name: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        rtctl.read_model(getattr(own_devices, name))
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("rate", "said"),
    [
        ("rates.uper(upper)", 'rates returns no "uper"; did you mean "upper"'),
        ("rates.upper(upper)", "rates takes 6 arguments (upper, lower, pump, gain, hole, outlet), got 1"),
        ("slopes.upper(upper)", 'the class has no function "slopes"'),
        (
            "rates.upper(upper, lower, upper, gain, hole, outlet)",
            'the argument pump "upper" is in cm, V is needed',
        ),
        ("rates.upper", "a call of a class such as rates.x(x, u), is needed here"),
    ],
)
def test_a_wrong_call_in_a_file_is_said(
    tanks: tuple[Path, Path], tmp_path: Path, rate: str, said: str
) -> None:
    tanks[0].write_text(
        tanks[0].read_text(encoding="utf-8") + f'[model.states]\nupper = {{ rate = "{rate}" }}\n',
        encoding="utf-8",
    )
    with pytest.raises(InputError) as caught:
        rtctl.read_model(tanks[0])
    assert said in str(caught.value)


def test_a_call_without_a_class_and_a_class_that_is_not_there_are_said(tmp_path: Path) -> None:
    file = tmp_path / "model.toml"
    file.write_text(own_devices.FAST.replace("slow*(x - y)", "rates.y(x)"), encoding="utf-8")
    with pytest.raises(InputError, match="the model names no class"):
        rtctl.read_model(file)
    file.write_text('[model]\nkind = "equations"\npython = "nowhere:Tank"\n', encoding="utf-8")
    with pytest.raises(InputError, match='there is no module "nowhere" beside the file'):
        rtctl.read_model(file)


def test_an_export_says_that_other_programs_cannot_call_a_class(
    tanks: tuple[Path, Path], tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=r"model\.python: the rates are functions of own_devices:Tanks"):
        rtctl.export_fmu(tanks[0], tmp_path / "tanks.fmu")
