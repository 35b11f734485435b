"""Shares of the error that causes remove add up to what their set removes, also where one could stand for another."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from rtctl.diagnosis.report import shares
from rtctl.diagnosis.report.rounding import LEFT
from rtctl.diagnosis.report.shares import sequential_shares, shares_that_return
from rtctl.diagnosis.report.words.findings import describe_shares
from rtctl.diagnosis.result import ERROR, Cause


def outcome(costs: dict[str, float], chosen: str) -> Any:
    """The outcome of a search whose sets, by the letters of their mechanisms beside the nominal "n", have `costs`."""
    sets = {names: SimpleNamespace(mechanisms=("n", *names), cost=cost) for names, cost in costs.items()}
    return SimpleNamespace(
        nominal=SimpleNamespace(hypothesis=sets[""]), chosen=SimpleNamespace(hypothesis=sets[chosen]),
        hypotheses=[one for names, one in sets.items() if names and len(names) != len(chosen) - 1],
        leave_one_out=[one for names, one in sets.items() if len(names) == len(chosen) - 1 > 0],
    )  # fmt: skip


@pytest.fixture(autouse=True)
def no_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shares, "noise_cost_of", lambda tested: 0.0)


def test_causes_that_replace_each_other_do_not_all_count_as_nothing() -> None:
    found = outcome(
        {"": 100.0, "g": 2.0, "c": 3.0, "f": 60.0, "gc": 1.9, "gf": 0.5, "cf": 0.6, "gcf": 0.4}, "gcf"
    )
    assert shares_that_return(found) == pytest.approx({"g": 0.002, "c": 0.001, "f": 0.015})
    assert sequential_shares(found) == pytest.approx({"g": 0.98, "f": 0.015, "c": 0.001})


def test_a_cause_alone_has_the_share_of_its_set() -> None:
    found = outcome({"": 100.0, "g": 2.0}, "g")
    assert sequential_shares(found) == shares_that_return(found) == pytest.approx({"g": 0.98})


def test_where_no_smaller_set_was_fitted_the_rest_is_shared_equally() -> None:
    found = outcome({"": 100.0, "abcd": 4.0, "abc": 10.0, "bcd": 20.0}, "abcd")
    assert sequential_shares(found) == pytest.approx({"d": 0.06, "a": 0.3, "b": 0.3, "c": 0.3})


def cause(identity: str, share: float, share_of: str = ERROR, probability: float | None = None) -> Cause:
    return Cause(identity, "", "mechanism", probability, {}, share, (), share_of=share_of)


FRICTION, GRAVITY = cause("friction.coulomb", 0.99), cause("stiffness.gravity", 0.01)
STEP = cause("sensor.quantisation", 0.99, LEFT)


def test_a_share_says_what_it_is_a_share_of() -> None:
    """A pendulum's 99 % + 1 % + 99 % read as if they were parts of one error."""
    assert FRICTION.certainty == "removes 99% of the error"
    assert STEP.certainty == "removes 99% of what is left then"
    assert "share_of" not in STEP.as_json()


@pytest.mark.parametrize(
    ("causes", "said", "unsaid"),
    [
        ((FRICTION, GRAVITY), ["nothing counts twice"], ["what is left"]),
        ((FRICTION, GRAVITY, STEP), ["nothing counts twice", "no part of the others"], []),
        ((FRICTION, STEP), ["no part of the others"], ["counts twice"]),
        ((FRICTION, cause("hysteresis.shape", 0.4)), ["they overlap"], ["counts twice"]),
    ],
)
def test_shares_of_several_causes_are_explained_once(
    causes: tuple[Cause, ...], said: list[str], unsaid: list[str]
) -> None:
    text = describe_shares(causes)
    assert all(one in text for one in said)
    assert not any(one in text for one in unsaid)


def test_one_share_and_probabilities_need_no_explanation() -> None:
    assert describe_shares((FRICTION,)) == ""
    assert describe_shares((cause("a", 0.5, probability=0.9), cause("b", 0.5, probability=0.9))) == ""
