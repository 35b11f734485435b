"""A search whose time runs out begins no further fit, tells the best that it has, and says so."""

from __future__ import annotations

from itertools import count
from pathlib import Path

from diagnosis_cases import friction_case

from rtctl.comparison import simulation_for
from rtctl.diagnosis.budget import Budget
from rtctl.diagnosis.causes import DiagnosisOptions
from rtctl.diagnosis.diagnose import diagnose
from rtctl.measured import open_dataset, read_dataset
from rtctl.models.oscillator import read_oscillator_model


def test_a_budget_is_spent_when_its_clock_has_run_so_far() -> None:
    ticks = count()
    budget = Budget.of(3.0, lambda: float(next(ticks)))  # begins at 0
    assert [budget.spent for _ in range(4)] == [False, False, True, True]


def test_without_time_nothing_is_fitted_no_cause_is_claimed_and_the_answer_says_so(tmp_path: Path) -> None:
    manifest = friction_case(tmp_path)
    heard: list[str] = []
    model = tmp_path / "model.toml"
    found = diagnose(
        read_dataset(manifest), read_oscillator_model(model), simulation_for(model, open_dataset(manifest)),
        ("friction.coulomb", "stiffness.cubic"), DiagnosisOptions(seconds=0.0, threads=1), heard.append,
    )  # fmt: skip
    assert heard == ["the nominal model"]
    assert (found.verdict, found.causes) == ("unexplained", ())
    assert found.search.out_of_time
    assert "ended after 0 s of processor time" in found.warnings[-1]
    assert found.json["out_of_time"] is True
