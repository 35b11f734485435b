"""Model files: every mistake is one message that names file, equation, term and units; units are converted once."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from equation_cases import OSCILLATOR, TANKS, simulation_of, written

import rtctl
from plant_sim.equations.reading import read_equations, system_of
from rtctl.border.errors import InputError
from rtctl.border.simulation import Stimulus

C_X2, K4_U = 'value = "c*x2"', "k4*u"
MISTAKES = [
    (K4_U, "k5*u", 'states.x1.rate = "-k1*sqrt(max(x1,0)) + k5*u": "k5" is unknown; did you mean "k4"?'),
    (K4_U, "k4*u*u", 'the term "k4*u*u" is in cm*V/s, cm/s is needed'),
    (K4_U, "3", 'the term "3" is a plain number, cm/s is needed'),
    (C_X2, 'value = "x2"', "it is in cm, the output's unit is V"),
    (C_X2, 'value = "c*x2 + 1"', 'the term "1" is a plain number, "c*x2" is in V; both need one unit'),
    (C_X2, 'value = "c*x2*exp(x1)"', 'in "exp(x1)" the argument "x1" is in cm, a plain number is needed'),
    (C_X2, 'value = "c*x2^k1"', 'the exponent "k1" is in cm^0.5/s'),
    (C_X2, 'value = "c*x2^(u/u)"', "the exponent must be a number"),
    (C_X2, 'value = "where(x1 > u, c*x2, c*x2)"', 'in "x1 > u" the term "u" is in V, "x1" is in cm'),
    (C_X2, 'value = "where(x1 > 0, c*x2, x2)"', 'the term "x2" is in cm, "c*x2" is in V'),
    ("max(x1,0)) + k", "max(x1,1)) + k", 'in "max(x1, 1)" the term "1" is a plain number, "x1" is in cm'),
    ("sqrt(max(x1,0)) + k", "sqrt(-x1) + k", "it is nan at the start"),
    (C_X2, 'value = "c*x2*9**9**9"', "it is inf at the start"),
    (C_X2, "value = \"__import__('os').system('true')\"", "at character 12 is not understood"),
    (C_X2, 'value = "c*x2.real"', "'.' at character 5: an operator, or a call of a class"),
    (C_X2, 'value = "y"', "an output stands in no equation"),
    (C_X2, 'value = "sqrt*x2"', "the function sqrt needs its arguments in brackets"),
    (C_X2, "value = true", "True is no expression"),
    ('rate = "-k1', 'rat = "-k1', 'key "model.states.x1.rate" is missing'),
    ('rate = "-k1', 'rat = "-k1', 'unknown key "model.states.x1.rat"; did you mean "rate"?'),
    ("c = { value = 0.8, ", "c = { ", 'key "model.parameters.c.value" is missing'),
    ('unit = "V/cm" }', 'unit = "V/cmm" }', "model.parameters.c.unit: unknown unit"),
    ('u = { unit = "V" }', 'u = { unit = "dBV" }', "model.inputs.u.unit:"),
    ('u = { unit = "V" }', 'u = { unit = "degC" }', "has its zero elsewhere"),
    ("x1", "sin", '"sin" is a function of the language; choose another name'),
    ("u = {", "t = {", '"t" is the time of the language'),
    ("c = {", "u = {", '"u" is the name of model.inputs.u too'),
    ("c = {", '"c-1" = {', '"c-1" is no name'),
    ("initial = 3.0, low = 0 }\nx2", "initial = -3.0, low = 0 }\nx2", "initial = -3 cm is beyond low = 0"),
    ("initial = 3.0, low = 0 }\nx2", "initial = 3.0, low = 4, high = 4 }\nx2", "low = 4 cm must be below high = 4 cm"),
    ("value = 0.8,", "value = 0.8, low = 1, high = 2,", "value = 0.8 V/cm must lie between low = 1 and high = 2"),
    ("[model.parameters]", '[model.terms]\na = "b + k1"\nb = "2*d"\nd = "a"\n[model.parameters]',
     "an algebraic loop: a needs b needs d needs a"),
    ("[model.parameters]", '[model.terms]\na = { value = "k1", unit = "cm" }\n[model.parameters]',
     'terms.a = "k1": the term "k1" is in cm^0.5/s, cm is needed'),
    (TANKS[TANKS.index("[model.states]") : TANKS.index("[model.outputs]")], "", 'key "model.states" is missing'),
    ('kind = "equations"', 'kind = "oscillator"', "an \"equations\" model is needed here"),
]  # fmt: skip


@pytest.mark.parametrize(("before", "after", "said"), MISTAKES)
def test_a_mistake_is_one_message_with_file_and_place(
    tmp_path: Path, before: str, after: str, said: str
) -> None:
    assert before in TANKS
    path = written(tmp_path, TANKS.replace(before, after))
    with pytest.raises(InputError) as caught:
        read_equations(path)
    assert said in str(caught.value)
    assert all(line.startswith(str(path)) for line in str(caught.value).splitlines())


def test_several_mistakes_come_together(tmp_path: Path) -> None:
    path = written(tmp_path, TANKS.replace(K4_U, "k5*u").replace("c*x2", "c*x3"))
    with pytest.raises(InputError) as caught:
        rtctl.read_model(path)
    assert len(str(caught.value).splitlines()) == 2


def test_a_model_is_read_written_and_read_again(tmp_path: Path) -> None:
    model = rtctl.read_model(written(tmp_path, TANKS))
    again = rtctl.read_model(model.save(tmp_path / "again.toml"))
    assert again.content == model.content
    assert again.parameters["k1"].unit == "cm^0.5/s"


def test_mixed_units_give_the_same_motion_as_one_set_of_units(tmp_path: Path) -> None:
    """The same tanks with one state in m, the other in mm, a rate per minute, the input in mV."""
    mixed = (
        TANKS.replace('x1 = { unit = "cm"', 'x1 = { unit = "m"')
        .replace("initial = 3.0, low = 0 }\nx2", "initial = 0.03, low = 0 }\nx2")
        .replace('x2 = { unit = "cm"', 'x2 = { unit = "mm"')
        .replace("initial = 3.0, low = 0 }\n[", "initial = 30.0, low = 0 }\n[")
        .replace('k1 = { value = 0.05, unit = "cm^0.5/s" }', 'k1 = { value = 0.3, unit = "m^0.5/min" }')
        .replace('c = { value = 0.8, unit = "V/cm" }', 'c = { value = 80, unit = "V/m" }')
    )
    inputs = 3.0 + np.sin(np.arange(60) / 5.0)
    runs = []
    for text, units, scale in ((TANKS, {"u": "V", "y": "V"}, 1.0), (mixed, {"u": "mV", "y": "uV"}, 1e3)):
        simulation = simulation_of(tmp_path, text, units)
        stimulus = Stimulus(inputs={"u": scale * inputs}, holds={"u": "zero"}, period_s=4.0)
        run = simulation.predict(stimulus, np.array([one.value for one in simulation.parameters]))
        runs.append(run.outputs["y"][0])
    assert np.ptp(runs[0]) > 0.3
    np.testing.assert_allclose(1e-6 * runs[1], runs[0], rtol=1e-9)


def test_signals_of_the_data_are_those_of_the_model(tmp_path: Path) -> None:
    for units, said in (
        ({"uu": "V", "y": "V"}, 'the data have a signal "uu", the model has none; did you mean "u"?'),
        ({"y": "V"}, 'model.inputs.u: the data have no signal "u"'),
        ({"u": "V"}, "model.outputs: the data have none of y"),
        ({"u": "V", "y": "mm"}, '"y" is in mm in the data, which is not compatible with V of the model'),
    ):
        with pytest.raises(InputError) as caught:
            simulation_of(tmp_path, TANKS, units)
        assert said in str(caught.value)


def test_a_term_is_used_where_it_is_named(tmp_path: Path) -> None:
    text = OSCILLATOR.replace("(stiffness + stiffness_cubic*z^2)*z", "spring").replace(
        "[model.outputs]",
        '[model.terms]\nspring = "hard*z"\nhard = "stiffness + stiffness_cubic*z^2"\n[model.outputs]',
    )
    system = system_of(read_equations(written(tmp_path, text)), "model")
    assert list(system.terms) == ["hard", "spring"]
    inputs = {"drive": np.random.default_rng(1).standard_normal(200)}
    stimulus = Stimulus(inputs=inputs, holds={"drive": "linear"}, period_s=2e-3)
    found = []
    for one in (text, OSCILLATOR):
        simulation = simulation_of(tmp_path, one, {"drive": "V", "displacement": "mm"})
        values = np.array([parameter.value for parameter in simulation.parameters])
        found.append(simulation.predict(stimulus, values).outputs["displacement"])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-12, atol=1e-15)


def test_a_file_with_random_slips_is_a_model_or_one_message(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    texts = re.findall(r'(?:rate|value|unit) = "([^"]*)"', TANKS)
    pieces = [
        *re.findall(r"[\w.]+|[^\w\s]", " ".join(texts)),
        "9**9**9",
        "1e308",
        "nan",
        "dB",
        "cm**9**9",
        "t",
        "pi",
        "(",
        "é",
    ]
    read, said = 0, list[str]()
    for _ in range(120):
        text = str(random.choice(texts))
        parts = re.findall(r"[\w.]+|[^\w\s]", text)
        parts[int(random.integers(len(parts)))] = str(random.choice(pieces))
        try:
            read_equations(written(tmp_path, TANKS.replace(f'"{text}"', f'"{" ".join(parts)}"', 1)))
            read += 1
        except InputError as error:
            said.append(str(error))
    assert 0 < read < 120
    assert all(one.startswith(str(tmp_path)) for one in said)
