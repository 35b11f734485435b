"""The VO2 paper's study: every step of the short command yields its figures, and its claims hold on them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rtctl.cli import main
from rtctl.estimators.gap_free import GapFreeEstimator
from rtctl.models.vo2 import read_model
from rtctl.reproduce.vo2 import paper
from rtctl.reproduce.vo2.bench import IDENTIFICATION_SEEDS, SEEDS, spread
from rtctl.reproduce.vo2.steps.equation_11 import inverse_error
from rtctl.reproduce.vo2.steps.excitation import SteadyLoops, finer, major_branches, widths
from rtctl.reproduce.vo2.steps.frequency import PHASES, change
from rtctl.reproduce.vo2.steps.rate import RateTermEstimator
from rtctl.reproduce.vo2.study import STUDY

Parts = dict[str, dict[str, dict[str, Any]]]

pytestmark = (
    pytest.mark.slow
)  # half a minute; the frame, and steps of the two other studies, are in every check


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of the short command, run once."""
    found: Path = tmp_path_factory.mktemp("vo2")
    assert main(["reproduce", "vo2", "--out", str(found), "--short", "--quiet"]) == 0
    return found


@pytest.fixture(scope="module")
def parts(folder: Path) -> Parts:
    """By the step's name and the part's title."""
    results = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    return {
        section["name"]: {part.get("title", part.get("file")): part for part in section["parts"]}
        for section in results["sections"]
    }


def number(cell: str) -> float:
    """The first of a cell such as "0.27 (0.26–0.28)"."""
    return float(cell.split()[0])


def table(parts: Parts, step: str, beginning: str) -> list[dict[str, str]]:
    """Rows of the step's table whose title so begins, by header."""
    found = [part for title, part in parts[step].items() if title.startswith(beginning)]
    assert len(found) == 1
    return [dict(zip(found[0]["headers"], row, strict=True)) for row in found[0]["rows"]]


def compared(parts: Parts, step: str) -> dict[str, dict[str, Any]]:
    """Rows of all comparisons of a step by their quantity."""
    return {
        row["quantity"]: row
        for part in parts[step].values()
        if part["kind"] == "comparison"
        for row in part["rows"]
    }


def test_every_step_has_a_section_with_figures_and_a_picture(folder: Path, parts: Parts) -> None:
    assert list(parts) == [step.name for step in STUDY.steps]
    for step, found in parts.items():
        kinds = {part["kind"] for part in found.values()}
        assert kinds & {"comparison", "table"}, step
        assert "picture" in kinds, step
    report = (folder / "report.md").read_text(encoding="utf-8")
    for figure in ("4 and 5", "figure 6", "8 to 10", "figure 11", "figure 12", "14 to 16"):
        assert figure in report


def test_every_figure_that_the_paper_gives_has_its_row(parts: Parts) -> None:
    given = {
        row["paper"]
        for step in parts
        for row in compared(parts, step).values()
        if row["paper"] is not None and row["ours"] is not None
    }
    expected = {value for errors in paper.FIT.values() for value in errors}
    expected |= {errors.mean_percent for errors in (*paper.RANDOM.values(), *paper.TRACKING.values())}
    expected |= {errors.max_percent for errors in paper.RANDOM.values()} | set(paper.TIME_US.values())
    assert expected <= given


def test_minor_loops_leave_the_major_one_and_a_nested_operator_cannot(parts: Parts) -> None:
    row = table(parts, "excitation", "How far minor")[0]
    device, preisach = number(row["device, mean of the recordings"]), number(row["preisach"])
    assert device > 0.5  # um
    assert preisach < 0.1 * device
    assert abs(number(row["observer"]) - device) < 0.2 * device


def test_deflection_changes_with_frequency_against_current_and_not_against_resistance(parts: Parts) -> None:
    rows = {row["frequency [Hz]"]: row for row in table(parts, "frequency", "Change of the loops")}
    against_current = [number(rows[f]["D–I, mean"]) for f in ("10", "30")]
    against_resistance = [number(rows[f]["D–R, mean"]) for f in ("10", "30")]
    assert against_current[1] > 2.0 * against_current[0] > 20.0 * max(against_resistance)


def test_the_observer_reaches_the_target_on_random_currents(parts: Parts) -> None:
    rows = table(parts, "random_current", "Self-sensing error")
    full = next(row for row in rows if row["identified on"] == "full")
    assert number(full["observer"]) <= 0.5
    assert all(number(full[kind]) > number(full["observer"]) for kind in ("composite", "preisach", "egpi"))


def test_feedforward_and_feedback_each_earn_their_place(parts: Parts) -> None:
    """On the multisine the PI alone is too slow; in a warmer room the feedforward alone is lost."""
    still = {row["scheme"]: row for row in table(parts, "beyond", "Device as identified")}
    warmer = {row["scheme"]: row for row in table(parts, "beyond", "Device 1 degC warmer")}
    both, column = "feedforward + PI, observer", "1 + 10 Hz"
    assert number(still[both][column]) <= 2.0 < number(still["PI, observer"][column])
    assert number(warmer[both][column]) < 0.3 * number(warmer["feedforward alone"][column])


def test_equation_11_needs_its_minus() -> None:
    assert inverse_error(paper.GPI_WEIGHTS, -1.0) < 1e-12
    assert inverse_error(paper.GPI_WEIGHTS, 1.0) > 0.5


def test_a_loop_does_not_differ_from_itself_and_from_one_that_is_shifted_by_the_shift() -> None:
    """d D / d I = 4 um a 10 mA on both branches of a parallelogram 2 mA wide; a shift of 1 um is 1 / 6 of its D."""
    turn = 2.0 * np.pi * (np.arange(PHASES) + 0.5) / PHASES
    current = 5.0 - 5.0 * np.cos(turn)
    up = np.sin(turn) > 0.0
    deflection = 0.4 * current + np.where(up, 0.0, 2.0)
    folded = SteadyLoops(current, np.exp(-current), deflection)
    sweep = np.concatenate((np.linspace(0.0, 10.0, 500), np.linspace(10.0, 0.0, 500)[1:]))
    rising = np.arange(len(sweep)) < 500
    rest = SteadyLoops(sweep, np.exp(-sweep), 0.4 * sweep + np.where(rising, 0.0, 2.0))
    for along in ("current", "resistance"):
        assert change(rest, folded, along=along).mean < 0.5
        moved = folded._replace(deflection_um=deflection + 1.0)
        assert change(rest, moved, along=along).mean == pytest.approx(
            100.0 / np.ptp(rest.deflection_um), rel=0.02
        )


def test_width_and_branches_of_a_known_loop() -> None:
    """Rising along v - 1, falling along v + 1: 2 mA wide whatever is measured along it."""
    up, down = np.linspace(0.0, 10.0, 401), np.linspace(10.0, 0.0, 401)[1:]
    current = np.concatenate((up, down))
    seen = np.concatenate((np.clip(up - 1.0, 0.0, 8.0), np.clip(down + 1.0, 0.0, 8.0)))
    loops = SteadyLoops(current, np.exp(-seen), 3.0 * seen)
    cooling, heating = major_branches(current)
    assert current[heating[-1]] == current[cooling[0]] == 10.0
    assert widths(loops) == pytest.approx((2.0, 2.0), abs=0.03)
    assert widths(finer(loops, 8)) == pytest.approx((2.0, 2.0), abs=0.03)


def test_a_rate_term_adds_kappa_times_the_rate_of_the_surrogates_square_and_nothing_at_rest(
    folder: Path,
) -> None:
    """Against the gap-free composite on the same readings; kappa = 2 um s/mA^2, samples 1 ms apart."""
    file = next((folder / "work").rglob("full-*.toml"))
    model = read_model(file)
    plain, rated = GapFreeEstimator(model), RateTermEstimator(model, 2.0)
    readings = np.geomspace(0.9 * model.resistance.high, 2.0 * model.resistance.low, 20).tolist()
    before = plain.start((6.0,), (readings[0],))
    rated.start((6.0,), (readings[0],))
    for ohm in readings[1:]:
        alone, both = plain.step((6.0,), (ohm,), 1e-3), rated.step((6.0,), (ohm,), 1e-3)
        rate = (alone.surrogate**2 - before.surrogate**2) / 1e-3
        assert rate > 0.0
        assert both.value == pytest.approx(alone.value + 2.0 * rate)
        before = alone
    assert rated.step((6.0,), (readings[-1],), 1e-3).value == pytest.approx(alone.value, abs=1e-6)


def test_a_film_that_lags_shows_in_the_rate_term(parts: Parts) -> None:
    rows = {row["lag of the device [ms]"]: row for row in table(parts, "rate", "The rate term")}
    assert number(rows["1"]["identified"]) < 3.0 * number(rows["0"]["identified"]) < 0.0


def test_the_paper_s_percentages_are_of_its_range() -> None:
    assert paper.FIT["composite"].mean_percent == pytest.approx(1.67, abs=0.005)
    assert paper.TRACKING["multisine_1_10hz", "composite"].mean_percent == pytest.approx(4.26, abs=0.005)


def test_reported_seeds_are_none_that_anything_was_tuned_on() -> None:
    assert not {*SEEDS, *IDENTIFICATION_SEEDS.values()} & {5, 11, 12, 13, 901}
    assert not set(SEEDS) & set(IDENTIFICATION_SEEDS.values())
    assert spread([0.2, 0.3, 0.4]) == "0.30 (0.20–0.40)"
