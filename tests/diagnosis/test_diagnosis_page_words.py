"""What a page says of tests, tried sets and the next experiment agrees with its tables."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from rtctl.diagnosis.experiment_design.design import Design, ScoredInput
from rtctl.diagnosis.report.page.sections import describe_tests, tabulate_candidates, tabulate_menu
from rtctl.diagnosis.result import share_text
from rtctl.diagnosis.thresholds import Thresholds
from rtctl.diagnosis.verification.rivals import choose_rivals
from rtctl.diagnosis.verification.verdict import Verdict

LEVEL = 0.01
PROBLEM = SimpleNamespace(thresholds=Thresholds())


def answer(verdict: str, *p_values: float) -> Any:
    """A diagnosis whose nominal model is the answer, with the tests of its residual."""
    tests = tuple(SimpleNamespace(p_value=p) for p in p_values)
    tested = SimpleNamespace(
        tests=tests, p_value=min(p_values) * len(p_values), hypothesis=SimpleNamespace(mechanisms=())
    )
    search = SimpleNamespace(nominal=tested, chosen=tested, rankings=())
    return SimpleNamespace(verdict=verdict, level=LEVEL, search=search, causes=(), problem=PROBLEM)


def test_the_threshold_of_the_tests_is_on_the_page() -> None:
    said = describe_tests(answer("adequate", 0.3, 0.2, 0.9, 0.02, 0.6))
    assert "Something is left where a p is below 0.002: 0.01, shared by 5 tests." in said
    assert "counts as chance" not in said


def test_a_small_p_of_a_model_with_nothing_wrong_is_explained() -> None:
    said = describe_tests(answer("adequate", 0.3, 1.4e-4, 0.9, 0.02, 0.6))
    assert "The smallest p, 0.00014, is below that. It counts as chance" in said
    assert "counts as chance" not in describe_tests(answer("unexplained", 1e-9, 0.5))


@pytest.mark.parametrize(("p", "said"), [(0.2, "passes the residual tests above"), (1e-9, "find something")])
def test_where_no_set_was_tried_the_page_says_why(p: float, said: str) -> None:
    assert said in tabulate_candidates(answer("adequate", p, 0.5))


@pytest.mark.parametrize("claim", ["explained", "partly_explained"])
def test_a_set_that_the_data_refute_is_no_rival_of_causes_that_are_named(claim: str) -> None:
    refuted: Any = SimpleNamespace(hypothesis="refuted")
    chosen: Any = "chosen"
    equivalent: Any = "equivalent"
    search: Any = SimpleNamespace(
        chosen=SimpleNamespace(hypothesis=chosen), equivalent=(equivalent,), rankings=((refuted,),)
    )
    limits = Thresholds().verification
    assert choose_rivals(search, Verdict(claim=claim), limits) == [chosen, equivalent]
    search.equivalent = ()
    assert choose_rivals(search, Verdict(claim=claim), limits) == []
    assert choose_rivals(search, Verdict(claim="unexplained"), limits) == [refuted.hypothesis]


def named(statement: str) -> Any:
    """An input of the menu."""
    return SimpleNamespace(statement=statement)


def test_the_table_of_inputs_begins_with_what_is_proposed() -> None:
    slow, quick, fine = (
        ScoredInput(named(f"square wave of {hz} Hz"), separation, whole)
        for hz, separation, whole in ((35, 2070.0, False), (50, 1900.0, False), (71, 1600.0, True))
    )
    proposed: Any = SimpleNamespace(
        plan=Design(((fine, 1),), 1600.0), menu=(slow, quick, fine), in_vain=False
    )
    shown: Any = SimpleNamespace(next_experiment=proposed, problem=PROBLEM)
    table = tabulate_menu(shown)
    assert "<b>square wave of 71 Hz: proposed</b>" in table
    places = [table.index(f"square wave of {hz} Hz") for hz in (71, 35, 50)]
    assert places == sorted(places)
    assert table.count("proposed</b>") == 1


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.0002, "less than 0.1%"), (0.004, "0.4%"), (0.72, "72%"), (0.994, "99%"), (0.997, "99.7%"),
        (0.99999, "more than 99.9%"), (1.0, "more than 99.9%"),
    ],
)  # fmt: skip
def test_no_share_is_rounded_to_all_of_the_error(share: float, text: str) -> None:
    assert share_text(share) == text
