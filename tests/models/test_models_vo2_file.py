"""Model files: exact to the bit, and every wrong key named."""

from __future__ import annotations

import copy
import dataclasses
import math

import numpy as np
import pytest
import tomli_w
from vo2_cases import DEVICES

from rtctl.border.errors import InputError
from rtctl.hysteresis.egpi import EgpiModel
from rtctl.hysteresis.gap_free import GapFreeModel
from rtctl.hysteresis.gpi import GpiModel
from rtctl.hysteresis.preisach.model import PreisachModel
from rtctl.models.span import Span
from rtctl.models.vo2 import FitQuality, Vo2Model, model_tables, read_model, write_model

QUALITY = (
    "resistance_gpi", "composite", "gap_free_composite", "resistance_gap_free", "resistance_preisach",
    "deflection_egpi", "deflection_preisach", "direct_preisach", "direct_egpi",
)  # fmt: skip
THIRD = 1.0 / 3.0  # has no short decimal


def gpi():
    return GpiModel(
        p=np.array([40.0, THIRD]), r=np.array([0.0, 0.5]), a_R=1.6, b_R=-11.4, a_L=1.6, b_L=-10.3, c=-70.0 * THIRD,
        v_low=3.7, v_high=8.5,
    )  # fmt: skip


def plays(**more):
    lines = {"a_R": 1.5, "b_R": -10.1 * THIRD * 3, "a_L": 1.5, "b_L": -9.6}
    return {
        "p": np.array([10.0, THIRD]), "r": np.array([0.0, 0.5]), "v_low": 3.7, "v_high": 8.5,
        **{name: np.full(2, value) for name, value in lines.items()}, **more,
    }  # fmt: skip


def preisach():
    return PreisachModel(
        grid=np.array([3.7, 5.0 + THIRD, 8.5]), mu=np.array([1.0, THIRD, 2.0]), c=-3.0, c2=-0.1 * THIRD
    )


@pytest.fixture
def model():
    egpi, fine = EgpiModel(**plays(c2=-THIRD, c3=60.0)), preisach()
    return Vo2Model(
        identity="VO2-A", time_constant_s=1.8e-3 * (1.0 + THIRD), time_constant_error_s=1e-6 * THIRD,
        current=Span(3.7, 8.5), resistance=Span(11.2e3, 130.0e3 * THIRD), deflection=Span(-1.6 * THIRD, 58.65),
        reading_error=2e-3 * THIRD, deflection_error=0.06 * THIRD, resistance_gpi=gpi(), composite_egpi=egpi,
        resistance_gap_free=GapFreeModel(**plays(q1=THIRD, c=1.0)), gap_free_egpi=egpi, deflection_egpi=egpi,
        resistance_preisach=fine, deflection_preisach=fine, direct_preisach=fine, direct_egpi=egpi,
        quality=dict.fromkeys(QUALITY, FitQuality(THIRD, 1.0, 0.5, "um", 57.0)),
        provenance={"dataset": "d", "note": 'a "b"'}, timing_skew_rows=1.0, reading_error_elsewhere=7e-3 * THIRD,
        deflection_error_elsewhere=0.2 * THIRD,
    )  # fmt: skip


def assert_same_bits(one, other):
    """Field by field, through nested dataclasses, tuples, mappings and arrays."""
    assert type(one) is type(other)
    if dataclasses.is_dataclass(one):
        for field in dataclasses.fields(one):
            assert_same_bits(getattr(one, field.name), getattr(other, field.name))
    elif isinstance(one, np.ndarray):
        assert one.tobytes() == other.tobytes()
    elif isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            assert_same_bits(one[key], other[key])
    elif isinstance(one, tuple):
        for a, b in zip(one, other, strict=True):
            assert_same_bits(a, b)
    else:
        assert one == other


def test_a_model_file_is_read_back_exact_to_the_bit(model, tmp_path):
    path = tmp_path / "deep" / "model.toml"
    write_model(model, path)
    assert_same_bits(read_model(path), model)
    assert [file.name for file in path.parent.iterdir()] == ["model.toml"], "nothing half-written stays"


def test_a_file_written_again_is_the_same_file(model, tmp_path):
    write_model(model, tmp_path / "one.toml")
    write_model(read_model(tmp_path / "one.toml"), tmp_path / "two.toml")
    assert (tmp_path / "one.toml").read_bytes() == (tmp_path / "two.toml").read_bytes()


@pytest.mark.parametrize("name", DEVICES)
def test_an_identified_model_is_read_back_exact_to_the_bit(identified, name, tmp_path):
    model = identified(name).model
    write_model(model, tmp_path / "model.toml")
    assert_same_bits(read_model(tmp_path / "model.toml"), model)


def test_an_unknown_time_constant_has_no_interval_and_stays_unknown(model, tmp_path):
    nominal = dataclasses.replace(model, time_constant_error_s=math.inf)
    write_model(nominal, tmp_path / "model.toml")
    text = (tmp_path / "model.toml").read_text()
    assert "inf" not in text
    assert_same_bits(read_model(tmp_path / "model.toml"), nominal)


def test_the_interval_of_the_time_constant_is_two_standard_errors_either_side(model):
    tau = model_tables(model)["model"]["parameters"]["thermal_time_constant"]
    assert (tau["unit"], tau["value"], tau["standard_error"]) == (
        "s", model.time_constant_s, model.time_constant_error_s,
    )  # fmt: skip
    assert tau["low"] == pytest.approx(model.time_constant_s - 2.0 * model.time_constant_error_s)
    assert tau["high"] == pytest.approx(model.time_constant_s + 2.0 * model.time_constant_error_s)


def test_units_of_a_hand_edited_file_are_converted(model, tmp_path):
    tables = model_tables(model)
    tables["model"]["parameters"]["thermal_time_constant"] = {"value": 2500.0, "unit": "us"}
    tables["model"]["parameters"]["resistance_high"] = {"value": 150.0, "unit": "kohm"}
    (tmp_path / "model.toml").write_text(tomli_w.dumps(tables))
    edited = read_model(tmp_path / "model.toml")
    assert edited.time_constant_s == pytest.approx(2.5e-3)
    assert math.isinf(edited.time_constant_error_s), "the interval went with the edit"
    tables["model"]["parameters"]["thermal_time_constant"] |= {"low": 2460.0, "high": 2540.0}
    (tmp_path / "model.toml").write_text(tomli_w.dumps(tables))
    assert read_model(tmp_path / "model.toml").time_constant_error_s == pytest.approx(20e-6)
    assert edited.resistance.high == pytest.approx(150e3)


def test_provenance_is_added_to(model):
    more = model.with_provenance(version="1")
    assert more.provenance == {"dataset": "d", "note": 'a "b"', "version": "1"}
    assert "version" not in model.provenance


DROP = object()


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("kind", "oscillator", ["model.kind", "oscillator"]),
        ("kind", DROP, ["model.kind"]),
        ("parameters", DROP, ["parameters", "missing"]),
        ("hysteresis", DROP, ["hysteresis", "missing"]),
        ("parameters.thermal_time_constant", DROP, ["thermal_time_constant", "missing"]),
        ("parameters.current_low", DROP, ["current_low", "missing"]),
        ("parameters.reading_error.value", DROP, ["reading_error", "value", "missing"]),
        ("parameters.reading_error.unit", DROP, ["reading_error", "unit", "missing"]),
        ("parameters.reading_error.value", math.nan, ["reading_error", "finite"]),
        ("parameters.reading_error.value", -1e-3, ["reading_error", "> 0"]),
        ("parameters.deflection_error.value", -0.1, ["deflection_error", "> 0"]),
        ("parameters.deflection_error.value", "much", ["deflection_error"]),
        ("parameters.thermal_time_constant.value", 0.0, ["thermal_time_constant", "> 0 s"]),
        ("parameters.thermal_time_constant.value", -1.8, ["thermal_time_constant", "> 0 s"]),
        ("parameters.thermal_time_constant.value", math.nan, ["thermal_time_constant", "finite"]),
        ("parameters.thermal_time_constant.unit", "mA", ["thermal_time_constant", "mA"]),
        ("parameters.thermal_time_constant.low", math.nan, ["thermal_time_constant", "low"]),
        ("parameters.thermal_time_constant.low", 9.0, ["thermal_time_constant", "low"]),
        ("parameters.thermal_time_constant.standard_error", -math.inf, ["standard_error", "finite"]),
        ("parameters.timing_skew_rows.value", 50.0, ["timing_skew_rows", "0 to 1", "50"]),
        ("parameters.timing_skew_rows.value", math.nan, ["timing_skew_rows", "finite"]),
        ("parameters.deflection_error_elsewhere.value", -1.0, ["deflection_error_elsewhere", ">= 0 um"]),
        ("parameters.current_low.value", -0.1, ["current_low", ">= 0 mA"]),
        ("parameters.thermal_time_constant.low", DROP, ["thermal_time_constant", "low"]),
        ("parameters.current_high.value", 3.0, ["current_low", "= 3.7 mA", "current_high = 3 mA"]),
        ("parameters.resistance_low.value", math.inf, ["resistance_low", "finite"]),
        ("parameters.resistance_low.value", -5.0, ["resistance_low", "> 0"]),
        ("parameters.deflection_low.value", 58.65, ["deflection_low", "deflection_high"]),
        ("hysteresis.resistance_gpi", DROP, ["resistance_gpi", "missing"]),
        ("hysteresis.resistance_gpi.kind", "egpi", ["resistance_gpi", '"gpi" is needed']),
        ("hysteresis.resistance_gpi.a_R", DROP, ["resistance_gpi", "a_R", "missing"]),
        ("hysteresis.resistance_gpi.a_R", math.nan, ["resistance_gpi", "a_R"]),
        ("hysteresis.direct_egpi.p", [1.0], ["direct_egpi", "p must have shape"]),
        ("hysteresis.deflection_preisach.mu", [1.0, -1.0, 0.0], ["deflection_preisach", "mu must be >= 0"]),
        ("hysteresis.deflection_preisach.speed", 1.0, ["deflection_preisach", "unknown key"]),
        ("quality.composite.rms", DROP, ["quality.composite", "rms", "missing"]),
        ("quality.composite.rms", math.nan, ["quality.composite", "rms"]),
        ("quality.composite.best", 1.0, ["quality.composite", "best"]),
        ("quality.composite", DROP, ["quality.composite", "missing"]),
        ("hysteresis", 3, ["hysteresis"]),
        ("parameters.current_low", 3.7, ["current_low"]),
    ],
)
def test_a_wrong_model_file_is_refused_by_file_and_key(model, tmp_path, key, value, words):
    tables = copy.deepcopy(model_tables(model))
    *path, last = key.split(".")
    table = tables["model"]
    for part in path:
        table = table[part]
    if value is DROP:
        del table[last]
    else:
        table[last] = value
    file = tmp_path / "model.toml"
    file.write_text(tomli_w.dumps(tables))
    with pytest.raises(InputError) as caught:
        read_model(file)
    message = str(caught.value)
    assert str(file) in message
    assert "rtctl identify" in message or key == "kind"
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("text", "words"),
    [("", "[model] is missing"), ("model = 3\n", "[model] is missing"), ("[model\n", "not valid TOML")],
)
def test_a_file_that_is_no_model_is_refused(tmp_path, text, words):
    file = tmp_path / "model.toml"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        read_model(file)
    assert str(file) in str(caught.value)
    assert words in str(caught.value)
    with pytest.raises(InputError, match="no such file"):
        read_model(tmp_path / "absent.toml")
