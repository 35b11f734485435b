"""In a pipe a long search prints a line at each stage and now and then: elapsed time, share of its work, no ids."""

from __future__ import annotations

import sys
import threading

import pytest

from rtctl.api.diagnosing import stage_of_search, watched_search
from rtctl.border.work import count_work, metered
from rtctl.diagnosis.problem.cancellation import CancellationToken
from rtctl.output.fit_lines import FitLines, Lasting, reminded, work_texts
from rtctl.output.progress import Reporter


def test_a_line_a_stage_and_one_now_and_then() -> None:
    printed, now_s, share = list[str](), 0.0, 0.0
    lines = FitLines("diagnose x", lambda: share, stage_of_search, printed.append, lambda: now_s)
    lines.show("the nominal model")
    for k in range(120):  # two fits a second
        now_s, share = 0.5 * (k + 1), 0.005 * (k + 1)
        lines.show(("friction.coulomb", "drive.delay")[k % 2] + (" + mode.second" if k >= 60 else ""))
    assert printed == [
        "diagnose x: 0:00, the nominal model",
        "diagnose x: 0:00, causes one at a time",
        "diagnose x: 0:16, causes one at a time, 31 fits so far, 16% of the work budget, about 1:24 for the rest",
        "diagnose x: 0:30, sets of 2 causes, 61 fits so far, 30% of the work budget, about 1:10 for the rest",
        "diagnose x: 0:46, sets of 2 causes, 91 fits so far, 46% of the work budget, about 0:54 for the rest",
    ]
    lines.show("the next experiment")
    assert printed[-1] == "diagnose x: 1:00, the next experiment, 120 fits so far", (
        "it is no part of the budget"
    )


def test_a_line_now_and_then_while_nothing_is_heard(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight minutes of a sweep's residual went by without one."""
    printed, now_s = list[str](), 0.0
    lines = FitLines("diagnose x", lambda: None, stage_of_search, printed.append, lambda: now_s)
    lines.remind()
    assert printed == [], "nothing is under way"
    lines.show("the nominal model")
    lines.show(Lasting("about 0:25, at most 4:20"))
    for at_s in (10.0, 16.0, 20.0, 32.0):
        now_s = at_s
        lines.remind()
    assert printed[2:] == [f"diagnose x: 0:{k}, still at the nominal model" for k in (16, 32)]
    monkeypatch.setattr("rtctl.output.fit_lines.EVERY_S", 0.03)
    heard = threading.Event()
    with reminded(FitLines("y", lambda: None, stage_of_search, lambda text: heard.set())) as _:
        assert not heard.wait(0.1), "nothing is under way"
    real = FitLines("z", lambda: None, stage_of_search, lambda text: "still" in text and heard.set())
    real.show("the nominal model")
    with reminded(real):
        assert heard.wait(10.0)


def test_the_share_is_that_of_the_work_that_the_search_counts(capsys: pytest.CaptureFixture[str]) -> None:
    with watched_search("diagnose x", CancellationToken(), Reporter(quiet=False), 1000.0) as heard, metered():
        count_work(250.0)
        heard("drive.delay")
    assert capsys.readouterr().err == "diagnose x: 0:00, causes one at a time, 25% of the work budget\n"


def test_without_a_budget_no_share_is_told_and_beyond_it_no_time() -> None:
    assert work_texts(10.0, None) == []
    assert work_texts(10.0, 1.2) == ["the work budget is used up: the last comparisons"]
    assert work_texts(1.0, 0.5) == ["50% of the work budget"], "too early for a time"


@pytest.mark.parametrize(
    ("text", "stage"),
    [
        ("the nominal model", "the nominal model"),
        ("drive.lag", "causes one at a time"),
        ("drive.lag + mode.second + friction.coulomb", "sets of 3 causes"),
        ("nonparametric.spring", "laws without a formula, for comparison"),
        ("2 causes do not explain it", "2 causes do not explain it"),
    ],
)
def test_a_fit_belongs_to_a_stage(text: str, stage: str) -> None:
    assert stage_of_search(text) == stage


def test_how_long_it_takes_stays_on_a_terminal_where_fits_replace_each_other(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with Reporter(quiet=False).fits("diagnose x") as show:
        show(Lasting("about 0:25, at most 4:20"))
        show("friction.coulomb")
    lines = [line for line in capsys.readouterr().err.splitlines() if "about" in line]
    assert len(lines) == 1
    assert "diagnose x: about 0:25, at most 4:20" in lines[0]
    assert "now" not in lines[0], "it is no fit under way"
