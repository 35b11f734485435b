"""The language: what it says, what it refuses, and that no text is code, hangs or ends in a traceback."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from plant_sim.equations.language.evaluation import evaluate
from plant_sim.equations.language.parser import MOST_NODES, parse
from plant_sim.equations.language.tree import names_in, written

VALUES = {"x": 1.7, "y": -0.6, "k": 2.5, "t": 0.3}
PYTHON = {
    **{name: getattr(np, name) for name in ("sqrt", "exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh")},
    "abs": abs, "sign": np.sign, "min": min, "max": max, "floor": np.floor, "asin": np.arcsin, "acos": np.arccos,
    "atan": np.arctan, "atan2": np.arctan2, "where": lambda c, a, b: a if c else b, "pi": np.pi,
}  # fmt: skip


@pytest.mark.parametrize(
    "text",
    [
        "-k*sqrt(max(x, 0)) + 2*y", "2**-x**2", "-x**2", "(-x)**2", "x - (y - k) - 1", "x/(y*k)/2", "2e-3*x + .5 - 1.",
        "where(x > 0 and not (y < -1 or k >= 3), x, -y)", "(x**2)**y", "2**3**0.5", "min(x, y, k)*max(x, y)",
        "abs(y) + sign(y)*floor(k) - atan2(y, x)", "+x - -y", "sin(pi*x) + exp(-t/k)", "x*-y", "where(x == y, 1, 2)",
    ],
)  # fmt: skip
def test_an_expression_has_the_value_that_python_gives_it(text: str) -> None:
    expected = eval(text, {"__builtins__": {}}, PYTHON | VALUES)
    for form in (text, text.replace("**", "^"), written(parse(text))):
        assert float(evaluate(parse(form), VALUES)) == pytest.approx(float(expected), rel=1e-12)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "it is empty"),
        ("x +", "it ends where"),
        ("__import__('os')", '"\'" at character 12 is not understood'),
        ("x.real", "'.' at character 2"),
        ("x[0]", "'[' at character 2"),
        ("lambda: 1", "':' at character 7"),
        ("open(x)", '"open" is no function'),
        ("sinn(x)", 'did you mean "sin"?'),
        ("x = 3", "write == to compare"),
        ("x if y else k", "'if' at character 3: an operator or the end is needed"),
        ("1 < x < 2", "two comparisons in a row"),
        ("x > 1", "it is a condition, a number is needed"),
        ("2*(x > 1)", "a condition is no number"),
        ("where(x, 1, 2)", "takes a condition first"),
        ("x and y", '"and" joins conditions'),
        ("not x", '"not" denies a condition'),
        ("min(x)", "min takes 2 or more arguments, got 1"),
        ("atan2(x)", "atan2 takes 2 arguments, got 1"),
        ("1e400", "1e400 is too large"),
        ("(" * 100 + "x" + ")" * 100, "nested more than 40 deep"),
        ("-" * 3000 + "x", "nested more than 40 deep"),
        ("x^" * 60 + "2", "nested more than 40 deep"),
        ("+x" * 1500, "parts; divide it"),
        ("x" * 5000, "5000 characters are too long"),
    ],
)
def test_what_is_not_in_the_grammar_is_said_in_words(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        parse(text)


def test_the_longest_sum_and_product_that_are_allowed_are_worked_out() -> None:
    for operator in "+*":
        text = operator.join(["x"] * (MOST_NODES // 2))
        tree = parse(text)
        assert set(names_in(tree)) == {"x"}
        assert np.isfinite(float(evaluate(tree, {"x": 1.0})))
        assert parse(written(tree)) == tree


def test_a_tower_of_powers_is_a_number_beyond_all_at_once() -> None:
    assert float(evaluate(parse("9**9**9"), {})) == np.inf


PIECES = [
    *"+-*/^()<>=,.&|~!?:;'\"\\[]{}@#%$_ \n\t", "**", "==", "and", "or", "not", "if", "else", "lambda", "for", "in",
    "x", "y", "1", "2.5", "1e9", "9**9**9", "sqrt(", "where(", "max(", "__import__", "exec(", "open(", "é", "λ", "\x00",
]  # fmt: skip


@settings(max_examples=400, deadline=None)
@given(st.lists(st.sampled_from(PIECES), max_size=60).map("".join) | st.text(max_size=80))
@example("x" + "\u00b2")
def test_any_text_is_a_tree_or_a_sentence(text: str) -> None:
    try:
        tree = parse(text)
    except ValueError:
        return
    assert parse(written(tree)) == tree
    names = dict.fromkeys(names_in(tree), 1.5)
    float(evaluate(tree, names))
