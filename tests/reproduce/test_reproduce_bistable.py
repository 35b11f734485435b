"""The bistable beam's study: each step yields its section, and what it claims holds on the short campaign."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rtctl.border.simulation import Stimulus
from rtctl.cli import main
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.regression.streaming_gram import compute_filtered_gram, compute_weak_gram
from rtctl.identification.regression.weak_form import regress
from rtctl.reproduce.bistable.models import HM, RM5, TRUTH, heuristic
from rtctl.reproduce.bistable.protocol import DEVELOPMENT_SEED, RATE_HZ, Recorded, record, shaker
from rtctl.reproduce.bistable.regression import QUINTIC, constrained, least_squares
from rtctl.reproduce.bistable.study import STUDY


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("bistable")
    assert main(["reproduce", "bistable", "--out", str(out), "--short", "--quiet"]) == 0
    return out


def quantity(report: Path, name: str, section: str = "") -> dict[str, Any]:
    """A row of the report's comparisons."""
    results = json.loads((report / "results.json").read_text(encoding="utf-8"))
    rows = [
        row
        for one in results["sections"]
        if section in ("", one["name"])
        for part in one["parts"]
        if part["kind"] == "comparison"
        for row in part["rows"]
        if row["quantity"] == name
    ]
    assert len(rows) == 1, name
    return dict(rows[0])


@pytest.mark.slow
def test_every_step_yields_its_section_and_every_picture_is_there(report: Path) -> None:
    results = json.loads((report / "results.json").read_text(encoding="utf-8"))
    assert [one["name"] for one in results["sections"]] == [step.name for step in STUDY.steps]
    text = (report / "report.md").read_text(encoding="utf-8")
    for one in results["sections"]:
        for part in one["parts"]:
            if part["kind"] == "picture":
                assert 5_000 < (report / "pictures" / part["file"]).stat().st_size < 100_000
                assert part["file"] in text


@pytest.mark.slow
def test_the_threshold_finds_the_second_mode_of_the_short_campaign(report: Path) -> None:
    assert quantity(report, "records below R² 0.84")["ours"] == 2
    assert quantity(report, "of these without a second mode")["ours"] == 0


@pytest.mark.slow
def test_what_is_left_beyond_the_noise_finds_it_too_and_the_diagnosis_names_it(report: Path) -> None:
    results = json.loads((report / "results.json").read_text(encoding="utf-8"))
    section = next(one for one in results["sections"] if one["name"] == "outliers")
    table = next(part for part in section["parts"] if part["kind"] == "table")
    assert [row[1:] for row in table["rows"]] == [["2", "0", "0"], ["2", "0", "0"]]
    assert quantity(report, "second mode's frequency, diagnosis at 11.75 Hz")["ours"] == pytest.approx(
        83.0, abs=0.05
    )
    assert quantity(report, "error of simulation before over after, test records")["ours"] > 10.0


@pytest.mark.slow
def test_the_filter_is_biased_and_the_weak_form_is_not(report: Path) -> None:
    assert quantity(report, "quintic that the filter finds on RM5's truth, no noise")["ours"] > 120.0
    assert quantity(report, "quintic that it invents on a cubic truth, no noise")["ours"] > 20.0
    assert abs(quantity(report, "weak form, records kept: quintic off by")["ours"]) < 0.2
    assert quantity(report, "the paper's filter, records kept: quintic off by")["ours"] > 4.0


@pytest.mark.slow
def test_the_criteria_choose_the_truths_terms_on_the_weak_form(report: Path) -> None:
    for rule in ("one standard error from it", "BIC", "sparse regression from ten terms"):
        assert quantity(report, f"weak form, {rule}: number of terms")["ours"] == 4


@pytest.mark.slow
def test_the_heuristic_model_is_right_in_the_wells_and_wrong_outside(report: Path) -> None:
    by_hm, by_weak = (
        quantity(report, f"{name}: median error of free simulation, both wells")["ours"]
        for name in ("HM", "weak form")
    )
    assert by_hm > 5.0 * by_weak


@pytest.mark.slow
def test_a_sweep_settles_what_the_rule_calls_chaos(report: Path) -> None:
    assert (
        quantity(report, "HM: of these settled later")["ours"]
        <= quantity(report, "HM: starts that the rule calls chaotic")["ours"]
    )


def test_the_truth_has_the_heuristic_models_wells_and_the_regressions_outer_force() -> None:
    assert TRUTH.well_mm == pytest.approx(HM.well_mm, rel=1e-9)
    assert TRUTH.well_hz == pytest.approx(HM.well_hz, rel=1e-9)
    at = np.array([12.5])
    assert TRUTH.force(at) == pytest.approx(RM5.force(at), rel=1e-9)
    assert heuristic(HM.well_mm, HM.well_hz, 0.3) == pytest.approx(HM, rel=1e-9)


def one_record() -> Recorded:
    campaign = shaker(short=True, seed=DEVELOPMENT_SEED)._replace(record_s=3.0)
    return record(campaign, campaign.settings[5])


def test_a_record_is_a_function_of_its_number() -> None:
    first, again = one_record(), one_record()
    assert np.array_equal(first.displacement, again.displacement)
    assert np.array_equal(first.frame_velocity, again.frame_velocity)


@pytest.mark.slow
def test_without_noise_the_weak_form_finds_the_truth_and_the_wells_constrain_a_model() -> None:
    one = one_record()
    frame = one.frame_velocity
    gram = compute_weak_gram(one.clean, frame, 1.0 / RATE_HZ, 0.025)
    assert least_squares(gram, QUINTIC).beam == pytest.approx(TRUTH, rel=2e-3)
    t = np.arange(len(frame)) / RATE_HZ
    rate = 2.0 * np.pi * one.setting.frequency_hz
    drive = 1000.0 * one.amplitude * np.cos(rate * t + one.phase)
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "band-limited"}, period_s=1.0 / RATE_HZ)
    asked = ("damping", "stiffness", "stiffness_cubic", "stiffness.quintic.coefficient")
    fit = regress(
        [FitRecord(name="", stimulus=stimulus, measured={"displacement": one.clean})],
        asked,
        0.025,
        {"drive_gain": 1.0},
    )
    assert least_squares(gram, QUINTIC).beam == pytest.approx(list(fit.coefficients.values()), rel=2e-3)
    fixed = constrained(gram, 6.5).beam
    assert fixed.well_mm == pytest.approx(6.5, rel=1e-9)


@pytest.mark.parametrize("each", [True, False])
@pytest.mark.slow
def test_the_streaming_filter_is_the_papers_regression(each: bool) -> None:
    one = one_record()
    h = 1.0 / RATE_HZ
    fit = least_squares(compute_filtered_gram(one.displacement, one.frame_velocity, h, each=each), QUINTIC)

    def mean(signal: np.ndarray) -> np.ndarray:
        return np.convolve(signal, np.full(21, 1.0 / 21.0), "same")

    z = mean(one.displacement)
    v, f = np.gradient(z, h), -np.gradient(mean(one.frame_velocity), h)
    y = np.gradient(mean(v) if each else v, h) - f
    inner = slice(22, -22) if each else slice(12, -12)
    columns = np.column_stack([v, z, z**3, z**5])[inner]
    scale = np.abs(columns).max(axis=0)
    oracle = -np.linalg.lstsq(columns / scale, y[inner], rcond=None)[0] / scale
    assert fit.beam == pytest.approx(oracle.tolist(), rel=1e-6)
