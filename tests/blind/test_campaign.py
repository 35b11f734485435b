"""The campaign counts what became of every case: crashes, hangs, lines of another program, targets with intervals."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import campaign
import numpy as np
import pytest
import worker_cases
from campaign import overrides_of, read, report, seeds, tasks
from compare import compare
from details import answer, calibration
from figures import as_baseline, figures, known, separable
from further import resolved, resolved_but_for_equivalents
from program import Program
from rates import Rate
from workers import Limits, results

PROGRAM = Program(commit="abc", version="0", code="new")


def line(kind: str = "single", truth: tuple[str, ...] = ("drive.lag",), **more: Any) -> dict[str, Any]:
    causes = [{"id": name, "probability": 0.95, "or": []} for name in truth]
    made = {
        "sort": "main", "plant": "oscillator", "seed": 1, "kind": kind, "truth": list(truth), "variant": ["usual"],
        "equivalent": [], "share": 0.1, "miss_over_noise": 2.0, "noise": "white", "samples": 80_000, "fit_records": 5,
        "verdict": "explained" if truth else "adequate", "causes": causes, "judgement": "right", "cpu_s": 10.0,
        "test_error_over_noise": 1.01, "code": "new", "commit": "abc",
    }  # fmt: skip
    return made | more


@pytest.mark.parametrize(
    ("rate", "low", "high"),
    [(Rate(0, 20), 0.0, 0.1611), (Rate(18, 20), 0.6990, 0.9721), (Rate(5, 5), 0.5655, 1.0)],
)
def test_intervals_are_wilsons(rate: Rate, low: float, high: float) -> None:
    assert rate.interval == pytest.approx(
        (low, high), abs=1e-4
    )  # as statsmodels' proportion_confint has them


def test_a_case_that_dies_or_hangs_is_a_result_and_the_others_go_on() -> None:
    ends = ("done", "killed", "for ever", "too much memory", "done")
    given = [{"place": k, "ends": how} for k, how in enumerate(ends)]
    found = {
        x["place"]: x
        for x in results(given, worker_cases.run, 2, Limits(cpu_s=1.0, memory_GiB=2.0, wall_factor=600.0))
    }
    assert sorted(found) == [0, 1, 2, 3, 4]
    assert [found[k].get("answer") for k in (0, 3, 4)] == ["done", "no memory", "done"]
    assert [found[k]["died"] for k in (1, 2)] == ["crash", "timeout"]
    assert found[2]["truth"] == ["drive.lag"]  # what was known of it is kept
    assert "processor time" in found[2]["error"]


def test_a_program_that_changes_ends_the_campaign() -> None:
    with pytest.raises(RuntimeError, match="changed"):
        PROGRAM.check()


def test_a_case_that_died_is_judged_as_that() -> None:
    assert known({"died": "timeout", "kind": "null", "truth": []})["judgement"] == "timeout"
    assert known({"died": "crash"})["kind"] == "not generated"
    assert known(line() | {"died": "timeout", "stage": "baseline"})["judgement"] == "right"


def test_a_line_cut_off_is_run_again(tmp_path: Path) -> None:
    path = tmp_path / "cases.jsonl"
    path.write_text(json.dumps(line()) + "\n" + '{"sort": "ma')
    assert [x["seed"] for x in read(path)] == [1]


def test_seeds_of_both_plants_are_mixed_and_told_apart() -> None:
    asked = campaign._parser().parse_args(
        ["--oscillator", "0-5", "--vo2", "50000-50002", "--ambiguous", "90000-90002"]
    )
    made = tasks(asked)
    assert len(made) == len({(x["plant"], x["seed"]) for x in made}) == 12
    assert {x["plant"] for x in made[:4]} == {"oscillator", "vo2"}
    assert sum(x["overrides"].get("least_samples") == 16_000 for x in made) == 1
    assert [x["next_experiment"] for x in made].count(True) == 3
    assert overrides_of("main", "vo2", 3) == {}
    assert {overrides_of("ambiguous", "oscillator", k)["effects"][0] for k in range(8)} == set(campaign.ALIKE)
    assert "effects" not in overrides_of("ambiguous", "vo2", 3)
    assert seeds("none") == range(0)


def test_a_campaign_may_be_of_one_kind() -> None:
    """Of the pairs, say, of which a campaign of all kinds draws few; cases of few data stay single ones."""
    arguments = [
        "--oscillator",
        "0-6",
        "--vo2",
        "50000-50002",
        "--ambiguous",
        "90000-90002",
        "--kind",
        "pair",
    ]
    made = tasks(campaign._parser().parse_args(arguments))
    assert {(x["sort"], x["overrides"]["kind"]) for x in made} == {("main", "pair"), ("ambiguous", "single")}
    assert sum(x["overrides"].get("least_samples") == 16_000 for x in made) == 2


def test_each_target_stands_beside_what_was_measured() -> None:
    lines = [
        *(line(seed=k) for k in range(19)),
        line(seed=19, causes=[{"id": "drive.delay", "probability": 0.9, "or": []}], judgement="false"),
        line("null", (), seed=20), line("null", (), seed=21, verdict="unexplained", judgement="false"),
        line("null", (), seed=22, plant="vo2"),
    ]  # fmt: skip
    table = figures(lines, [])
    assert "| at least 95 % | 95.0 % (19 of 20; 76 to 99) | yes |" in table
    assert (
        "a single wrong name claimed alone (oscillator) | at most 1 % | 5.0 % (1 of 20; 1 to 24) | no |"
        in table
    )
    assert "said to be wrong (oscillator) | at most 5 % | 50.0 % (1 of 2; 9 to 91) | no |" in table
    assert "said to be wrong (vo2) | at most 5 % | 0.0 % (0 of 1; 0 to 79) | yes |" in table


def test_a_baseline_is_judged_on_the_same_truth() -> None:
    null = line("null", (), bic={"verdict": "explained", "causes": [{"id": "drive.lag", "or": []}]})
    assert as_baseline(null, "bic")["judgement"] == "false"
    assert "100.0 % (1 of 1; 21 to 100)" in figures([null], [])


def test_an_experiment_resolves_only_with_one_right_name() -> None:
    alone = {"verdict": "explained", "causes": [{"id": "drive.lag", "or": []}], "judgement": "right"}
    two = {
        "verdict": "explained",
        "causes": [{"id": "drive.lag", "or": ["drive.delay"]}],
        "judgement": "right",
    }
    case = line(next={"names": ["drive.delay", "drive.lag"], "proposed": alone, "random": two})
    assert resolved(case, "proposed")
    assert not resolved(case, "random")
    assert resolved_but_for_equivalents(case, "proposed")
    assert not resolved_but_for_equivalents(case, "random")
    assert resolved_but_for_equivalents(case | {"equivalent": ["drive.delay"]}, "random")
    assert not resolved_but_for_equivalents(case | {"equivalent": ["sensor.lag"]}, "random")
    assert separable(case)
    assert not separable(case | {"equivalent": ["drive.delay"]})  # no experiment can tell these apart
    doubted = case | {"next": case["next"] | {"decides": False, "proposed": two}}
    rows = figures([], [case | {"next": case["next"] | {"decides": True}}, doubted]).splitlines()
    assert "50.0 % (1 of 2;" in next(row for row in rows if "resolves an ambiguous case" in row)
    assert "100.0 % (1 of 1;" in next(row for row in rows if "where it is said to decide" in row)


def test_probabilities_are_compared_with_how_often_they_are_true() -> None:
    lines = [line(seed=k) for k in range(9)] + [line(truth=("drive.lag",), causes=[
        {"id": "sensor.lag", "probability": 0.95, "or": ["drive.lag"]}, {"id": "parameter.damping", "probability": 0.9,
                                                                         "or": []}])]  # fmt: skip
    [(stated, true)] = calibration(lines)
    assert stated == pytest.approx(0.95)
    assert true == Rate(9, 10)
    assert answer(lines[-1]) == "`parameter.damping` + `sensor.lag` (or drive.lag)"


def test_the_report_names_lines_of_another_program_and_draws(tmp_path: Path) -> None:
    lines = [line(seed=k, miss_over_noise=0.2 * k + 0.05) for k in range(4)]
    lines.append(
        {"sort": "main", "plant": "vo2", "seed": 9, "died": "crash", "error": "RuntimeError: no case"}
    )
    done = {campaign._key(x): x for x in lines}
    head = report(tmp_path, done, dict.fromkeys(done), [line(seed=7, commit="old")], PROGRAM, "make blind")
    assert "1 of old" in head
    assert "Not generated" in head
    text = (tmp_path / "blind.md").read_text()
    assert "## oscillator" in text
    for name in ("reliability.png", "hits.png"):
        assert np.frombuffer((tmp_path / name).read_bytes()[:8], np.uint8)[1:4].tobytes() == b"PNG"


def test_two_programs_are_compared_on_the_cases_that_both_have() -> None:
    right, wrong = line(seed=1), line(seed=1, verdict="unexplained", causes=[], judgement="missed", cpu_s=9.0)
    alike = line(seed=2)
    before = {("oscillator", one["seed"]): one for one in (right, alike, line(seed=3))}
    text = compare(before, {("oscillator", one["seed"]): one for one in (wrong, alike)})
    assert text.startswith("2 cases that both programs have answered")
    assert "| one effect: its id first, or in a set of two (oscillator) | 100.0 % (2 of 2;" in text
    assert "| 50.0 % (1 of 2;" in text
    assert "Verdict and causes are the same in 1 of 2." in text
    assert "| oscillator 1 |" in text
    assert "unexplained (missed) |" in text
