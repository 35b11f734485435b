"""A reading that is early is a late drive: a search fits one of them, and the answer names both."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, answer_to, device, measured, noise_drive, write_case

import rtctl
from rtctl.cli.printing.diagnosis import print_diagnosis
from rtctl.diagnosis.report.page.sections import bic_text, tabulate_candidates
from rtctl.diagnosis.report.page.summary import describe_causes, describe_verdict, name_with_rivals
from rtctl.diagnosis.report.ranking import label_of, stand_ins
from rtctl.diagnosis.report.same_laws import add_same_laws, find_same_laws
from rtctl.diagnosis.result import Cause

IDS = "drive.delay,timing.skew,sensor.offset,damping.quadratic"


def records(late_s: float) -> list[tuple[np.ndarray, np.ndarray, str]]:
    skewed = device({"id": "timing.skew", "parameters": {"late": {"value": late_s, "unit": "s"}}})
    drives = [
        (noise_drive(seed, level), use)
        for seed, level, use in ((1, 6.0, "fit"), (2, 9.0, "fit"), (3, 7.5, "test"))
    ]
    return [(drive, measured(skewed, drive), use) for drive, use in drives]


@pytest.mark.parametrize(
    ("periods", "others"),
    [(0.4, ["drive.delay"]), (1.0, []), pytest.param(1.4, [], marks=pytest.mark.slow)],
    ids=["within", "end", "beyond"],
)
def test_rows_that_are_read_late_may_be_read_at_the_end_of_a_period_with_a_late_drive(
    tmp_path: Path, periods: float, others: list[str]
) -> None:
    answer = answer_to(tmp_path, records(periods * PERIOD_S), IDS)
    (cause,) = answer["causes"]
    assert (cause["id"], cause["indistinguishable_from"]) == ("timing.skew", others)
    assert cause["parameters"]["late"]["value"] == pytest.approx(periods * PERIOD_S, rel=0.05)
    assert ("at the end of their period" in cause["statement"]) == bool(others)


@pytest.fixture(scope="module")
def early(tmp_path_factory: pytest.TempPathFactory) -> rtctl.Diagnosis:
    """Diagnosis of readings that are early, which a late drive is too."""
    folder = tmp_path_factory.mktemp("early")
    return rtctl.diagnose(write_case(folder, records(-0.4 * PERIOD_S)), folder / "model.toml", mechanisms=IDS)


def test_rows_that_are_read_early_are_a_late_drive_or_these(early: rtctl.Diagnosis) -> None:
    (cause,) = early.to_dict()["causes"]
    assert (cause["id"], cause["indistinguishable_from"]) == ("drive.delay", ["timing.skew"])
    assert cause["parameters"]["delay"]["value"] == pytest.approx(0.4 * PERIOD_S, rel=0.05)
    assert "same_law" not in cause, "the keys of the file are fixed"


def test_one_law_of_two_names_is_said_once_and_never_seems_refuted(
    early: rtctl.Diagnosis, capsys: pytest.CaptureFixture[str]
) -> None:
    said = "drive.delay and timing.skew are the same law in every record: nothing but knowledge of the bench decides"
    print_diagnosis(early.answer, Path("answer"))
    printed = capsys.readouterr().out
    assert (printed.count(said), printed.count("cannot tell")) == (1, 0)
    assert describe_causes(early.answer).count(said) == 1
    assert "Explained by drive.delay: with it, the residual is noise." in describe_verdict(early.answer)
    tried = tabulate_candidates(early.answer)
    assert "<td>drive.delay (the same law: timing.skew)</td>" in tried
    assert "<td>timing.skew</td>" not in tried
    assert early.next_experiment is None


@pytest.mark.parametrize(
    ("others", "name"),
    [
        ((), "drive.delay"),
        (("timing.skew",), "drive.delay"),
        (("timing.skew", "input.hold"), "drive.delay or input.hold, these data do not tell which"),
    ],
)
def test_a_verdict_names_only_rivals_that_data_could_refute(others: tuple[str, ...], name: str) -> None:
    cause = Cause("drive.delay", "The drive is late.", "mechanism", 0.9, {}, 1.0, others, ("timing.skew",))
    assert name_with_rivals([cause]) == name
    both = name_with_rivals([cause, cause._replace(id="sensor.lag", indistinguishable_from=())])
    assert both == (f"({name}) and sensor.lag" if "or" in name.split() else f"{name} and sensor.lag")


def test_a_set_with_the_same_law_under_its_other_name_is_no_rival() -> None:
    same = {"drive.delay": ("timing.skew",)}
    assert stand_ins(("drive.delay", "sensor.offset"), same) == {frozenset({"timing.skew", "sensor.offset"})}
    assert label_of(("drive.delay", "sensor.offset"), same) == (
        "drive.delay (the same law: timing.skew) + sensor.offset"
    )


def test_a_bic_far_above_the_best_has_no_digits() -> None:
    assert [bic_text(one, 1000.0) for one in (0.0, 12.34, 136936811.6)] == ["0.0", "12.3", "more than 1,000"]


@pytest.mark.slow
def test_where_the_skew_is_not_asked_for_the_delay_stands_alone(tmp_path: Path) -> None:
    (cause,) = answer_to(tmp_path, records(-0.4 * PERIOD_S), "drive.delay,sensor.offset")["causes"]
    assert (cause["id"], cause["indistinguishable_from"]) == ("drive.delay", [])


def test_a_constant_force_on_a_cubic_spring_is_a_quadratic_one_where_no_displacement_was_measured() -> None:
    ids, hard = (
        ("stiffness.quadratic", "drive.offset", "drive.lag"),
        device(stiffness_cubic=(6e5, "1/(mm^2*s^2)")),
    )
    same = find_same_laws(hard, ids, hard.extended(("drive.lag",)), {"acceleration"})
    assert same == {"stiffness.quadratic": ("drive.offset",), "drive.offset": ("stiffness.quadratic",)}
    assert find_same_laws(hard, ids, None, {"acceleration", "displacement"}) == {}
    assert find_same_laws(hard, ids[1:], None, {"acceleration"}) == {}
    assert find_same_laws(device(), ids, None, {"acceleration"}) == {}, "a straight spring has no other place"


@pytest.mark.parametrize("beside", ["damping.nonlinear", "stop.one_sided", "drive.deadband"])
def test_beside_what_shows_the_place_they_are_not_one_law(beside: str) -> None:
    ids, hard = ("stiffness.quadratic", "drive.offset"), device(stiffness_cubic=(6e5, "1/(mm^2*s^2)"))
    assert find_same_laws(hard, ids, hard.extended((beside,)), {"acceleration"}) == {}


def test_each_name_is_followed_by_those_of_its_law() -> None:
    same = find_same_laws(device(), ("drive.delay", "timing.skew", "drive.lag"))
    assert same == {"drive.delay": ("timing.skew",)}
    assert add_same_laws(("input.hold",), "drive.delay", same) == ("timing.skew", "input.hold")
    assert add_same_laws(("drive.delay", "input.hold"), "drive.lag", same) == (
        "drive.delay",
        "timing.skew",
        "input.hold",
    )
    assert add_same_laws(("drive.delay",), "timing.skew", same) == ("drive.delay",)
