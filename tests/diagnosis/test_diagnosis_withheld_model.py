"""An extended model is handed out only where causes are claimed and help on test records; its doubts go with it."""

from __future__ import annotations

import argparse
import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import device, friction_case, measured, noise_drive, write_case
from vo2_model_cases import small_model

import rtctl
from rtctl.cli import main
from rtctl.cli.verbs.modelling.diagnose import next_words, say_next_experiment
from rtctl.cli.verbs.modelling.identify import is_diagnosed_next
from rtctl.diagnosis.problem.subject import Rehearsal
from rtctl.diagnosis.report.files import scenario_text
from rtctl.diagnosis.report.words.findings import describe_spring, spring_sentence
from rtctl.diagnosis.search.holdout_error import Gain
from rtctl.diagnosis.verification.misfit_checks import require_model_follows
from rtctl.diagnosis.verification.verdict import Verdict
from rtctl.diagnosis.verification.verify import falls_elsewhere
from rtctl.models.provenance import doubt_of_model
from rtctl.plants.vo2 import diagnosis as vo2_diagnosis

FEW = "friction.coulomb,damping.quadratic"


@pytest.fixture(scope="module")
def friction(tmp_path_factory: pytest.TempPathFactory) -> rtctl.Diagnosis:
    """Diagnosis of a beam with dry friction."""
    folder = tmp_path_factory.mktemp("withheld")
    friction_case(folder)
    return rtctl.diagnose(folder / "dataset.toml", folder / "model.toml", mechanisms="friction.coulomb")


@pytest.fixture(scope="module")
def unexplained(tmp_path_factory: pytest.TempPathFactory) -> rtctl.Diagnosis:
    """Diagnosis of the same beam of which dry friction is not tried."""
    folder = tmp_path_factory.mktemp("unexplained")
    friction_case(folder)
    wrong = ["damping.quadratic", "stiffness.cubic"]
    return rtctl.diagnose(folder / "dataset.toml", folder / "model.toml", mechanisms=wrong)


def test_a_device_without_a_gap_gives_no_extended_model(
    tmp_path: Path,
) -> None:
    records = [
        (noise_drive(seed), measured(device(), noise_drive(seed)), use)
        for seed, use in ((1, "fit"), (2, "fit"), (3, "test"))
    ]
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "model-extended.toml").write_text("# rtctl diagnose 0.1.0: of an earlier answer")
    answer = rtctl.diagnose(write_case(tmp_path, records), tmp_path / "model.toml", mechanisms=FEW)
    answer.save(tmp_path / "out")
    found = answer.to_dict()
    assert (found["verdict"], found["model"]) == ("adequate", None)
    assert found["model_withheld"] == "no cause is claimed, so there is no extended model"
    assert not list(tmp_path.rglob("model-extended.toml"))


def test_an_uncertain_gain_withholds_the_model_and_keeps_the_name(
    friction: rtctl.Diagnosis, tmp_path: Path
) -> None:
    assert friction.model is not None
    gain = friction.answer.gain
    assert gain is not None
    unsure = replace(friction.answer, gain=gain._replace(ratio=1.1, ratio_low=0.9, ratio_high=1.3))
    shown = replace(friction, answer=unsure)
    assert shown.model is None
    assert [cause.id for cause in shown.causes] == ["friction.coulomb"]
    shown.save(tmp_path)
    assert not (tmp_path / "model-extended.toml").exists()
    said = json.loads((tmp_path / "diagnosis.json").read_text())["model_withheld"]
    assert said.endswith("1.1 times less, 95 % between 0.9 and 1.3")
    assert said[1:] in (tmp_path / "report.html").read_text()
    rises = gain._replace(ratio=0.5, ratio_low=0.25, ratio_high=0.8)
    assert rises.in_words == "2 times more, 95 % between 1.25 and 4"
    runs_away = gain._replace(after=np.inf, ratio=0.0, ratio_low=0.0, ratio_high=0.1)
    assert runs_away.in_words == "inf times more, 95 % between 10 and inf"


@pytest.mark.parametrize(("after", "handed_out"), [(0.053, True), (1.5, False)])
def test_a_model_that_helps_the_loop_alone_is_handed_out(
    friction: rtctl.Diagnosis, after: float, handed_out: bool
) -> None:
    gain, loop = friction.answer.gain, Rehearsal("self-sensing", 1.64, after, "um")
    assert gain is not None
    none = gain._replace(ratio=0.992, ratio_low=0.984, ratio_high=0.999)
    found = replace(friction.answer, gain=none, helps=False, loop=loop)
    assert (found.withheld == "") is handed_out


@pytest.mark.parametrize(("high", "handed_out"), [(1.2, True), (0.63, False)])
def test_another_error_that_falls_is_no_help_where_this_one_certainly_rises(
    friction: rtctl.Diagnosis, high: float, handed_out: bool
) -> None:
    gain = friction.answer.gain
    assert gain is not None
    worse = gain._replace(ratio=0.45, ratio_low=0.33, ratio_high=high)
    found = replace(friction.answer, gain=worse, helps=True, loop=None)
    assert (found.withheld == "") is handed_out


@pytest.mark.slow
def test_a_rehearsal_of_the_next_experiment_has_a_model_all_the_same(
    unexplained: rtctl.Diagnosis, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = unexplained
    assert (found.verdict, found.model) == ("unexplained", None)
    found.save(tmp_path / "out")
    assert not (tmp_path / "out" / "model-extended.toml").exists()
    scenario = tomllib.loads((tmp_path / "out" / "next-experiment.toml").read_text())
    assert scenario["driver"]["device"] == "next-experiment-model.toml"
    rehearse(tmp_path / "out", capsys)


@pytest.mark.slow
def test_a_rehearsal_leaves_out_what_no_device_can_have_and_says_so(
    unexplained: rtctl.Diagnosis, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nominal = unexplained.nominal.source
    assert nominal is not None
    held = tmp_path / "held.toml"
    held.write_text(nominal.read_text() + HELD)
    replace(unexplained, answer=replace(unexplained.answer, model=rtctl.read_model(held).content)).save(
        tmp_path / "out"
    )
    scenario = (tmp_path / "out" / "next-experiment.toml").read_text()
    assert "# The rehearsing device leaves out input.hold, timing.skew:" in scenario
    model = rtctl.read_model(tmp_path / "out" / "next-experiment-model.toml")
    assert model.mechanisms == ("friction.coulomb",)
    said = rehearse(tmp_path / "out", capsys)
    assert "These data are simulated, by the device next-experiment-model.toml" in said
    assert "leaves out input.hold, timing.skew, which the diagnosed model has" in said


@pytest.mark.parametrize(
    ("units", "told"),
    [({"drive": "V", "velocity": "mm/s"}, True), ({"drive": "V", "displacement": "mm"}, False)],
)
def test_a_rehearsal_of_velocities_says_that_its_device_reads_the_displacement(
    unexplained: rtctl.Diagnosis, units: dict[str, str], told: bool
) -> None:
    assert unexplained.next_experiment is not None
    text = scenario_text(unexplained.next_experiment, units=units)
    assert ("on the bench record the velocity again" in text) is told
    assert tomllib.loads(text)["scenario"]["plant"] == "oscillator"


HELD = """
[[model.mechanisms]]
id = "input.hold"
parameters = { toward_band_limited = { value = 1.0, unit = "dimensionless" } }
[[model.mechanisms]]
id = "timing.skew"
parameters = { late = { value = 1.0, unit = "ms" } }
[[model.mechanisms]]
id = "friction.coulomb"
parameters = { level = { value = 1.8, unit = "mm/s^2" } }
"""


def rehearse(folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """Run the command that a diagnosis prints next, and return what it says."""
    assert main(["acquire", str(folder / "next-experiment.toml"), "--out", str(folder / "next")]) == 0
    said = capsys.readouterr()
    assert (folder / "next" / "dataset.toml").exists()
    return said.out + said.err


@pytest.mark.parametrize(
    ("verdict", "error", "told"),
    [("adequate", 1.0, True), ("adequate", 1e-6, False), ("unexplained", 1.0, False)],
)
def test_an_error_far_above_the_noise_is_explained_beside_nothing_is_wrong(
    friction: rtctl.Diagnosis,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    verdict: str,
    error: float,
    told: bool,
) -> None:
    from rtctl.cli.printing.diagnosis import print_diagnosis

    gain = friction.answer.gain
    assert gain is not None
    found = replace(
        friction.answer, verdict=verdict, causes=(), gain=gain._replace(before=gain.noise_floor * 1e3 * error)
    )
    print_diagnosis(found, tmp_path)
    assert ("still far above the noise" in capsys.readouterr().out) is told


def test_what_is_left_beside_a_cause_takes_its_probability(
    friction: rtctl.Diagnosis, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    from rtctl.cli.printing.diagnosis import print_diagnosis

    (cause,) = friction.causes
    assert cause.probability is not None
    partly = replace(
        friction.answer, verdict="partly_explained",
        causes=(cause._replace(probability=None, share_removed=0.72),),
    )  # fmt: skip
    print_diagnosis(partly, tmp_path)
    said = capsys.readouterr().out
    assert "removes 72% of the error  friction.coulomb:" in said
    assert "What is left beside the noise on the " in said
    assert "% of the displacement itself: " in said
    assert partly.json["causes"][0]["probability"] is None
    assert "removes 72%" in replace(friction, answer=partly)._repr_html_()
    partial = replace(friction, answer=partly)
    partial.save(tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert "72%" in page
    assert "What is left beside the noise on the " in page
    assert "not stated" in page
    assert "A probability compares the causes of the catalogue" in page


def test_a_page_has_no_word_of_the_method_without_plain_ones(
    friction: rtctl.Diagnosis, tmp_path: Path
) -> None:
    friction.save(tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert "<h3>What the error goes with</h3>" in page
    assert "<p>Mostly with velocity sign (" in page
    for word in ("generic forces", "past motion and drive", " alone</td>", "lives along", "velocity_sign"):
        assert word not in page, word
    assert "anything that depends on the past of motion and drive" in page
    names = {one["name"] for one in friction.to_dict()["tests"]}
    assert {"generic forces", "past motion and drive"} <= names, "those of the file are fixed"


def test_a_spring_that_hardens_is_told_in_words(friction: rtctl.Diagnosis, tmp_path: Path) -> None:
    (stiff,) = [one for one in friction.answer.derived if one.name == "natural frequency"]
    told = (
        stiff._replace(name="hardening spring: cubic force equals linear force at", value=8.8, unit="mm"),
        stiff._replace(
            name="hardening spring: at the largest displacement, 20 mm, cubic over linear force", unit="1"
        ),
    )
    said = spring_sentence(told)
    assert said.startswith(
        "The spring hardens: its cubic force is as large as the linear one at 8.80000 mm, standard "
    )
    assert said.endswith(" % of it at the largest displacement, 20 mm.")
    assert spring_sentence((stiff,)) == ""


def test_no_spring_is_told_beside_causes_that_leave_something(
    friction: rtctl.Diagnosis, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rtctl.diagnosis.report.words.findings.spring_sentence", lambda derived: "a spring")
    assert describe_spring(friction.answer) == "a spring"
    for verdict in ("partly_explained", "unexplained"):
        assert describe_spring(replace(friction.answer, verdict=verdict)) == ""


def test_who_has_only_a_file_is_told_how_to_play_the_next_experiment(
    unexplained: rtctl.Diagnosis, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    proposed = unexplained.answer.next_experiment
    assert proposed is not None
    sure = proposed._replace(limits=replace(proposed.limits, alike_separation=0.0, deciding_separation=0.0))
    found = replace(unexplained, answer=replace(unexplained.answer, next_experiment=sure))
    assert not found.dataset.is_acquired
    args = argparse.Namespace(quiet=False, json=False, dataset=tmp_path / "dataset.toml", model=None)
    say_next_experiment(args, found, tmp_path)
    said = capsys.readouterr().out
    assert "Play it as you played the drive of these data, record it, and begin again with rtctl init" in said
    assert next_words(found, args, tmp_path)[:1] != ["acquire"]
    found.save(tmp_path)
    assert "begin again with rtctl init" in (tmp_path / "report.html").read_text()
    acquired = replace(found, dataset=replace(found.dataset, identity="beam 7"))
    say_next_experiment(args, acquired, tmp_path)
    assert capsys.readouterr().out == ""
    assert next_words(acquired, args, tmp_path)[0] == "acquire"


@pytest.mark.parametrize("passes", [True, False])
def test_the_caption_of_the_candidates_says_whether_the_claimed_set_passes(
    friction: rtctl.Diagnosis, passes: bool, tmp_path: Path
) -> None:
    search = friction.answer.search._replace(passes=passes)
    replace(friction, answer=replace(friction.answer, search=search)).save(tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert ("the set passes all residual tests above" in page) is passes
    assert ("the set fails some of the residual tests above" in page) is not passes


@pytest.mark.parametrize("place", ["provenance", "model.provenance"])
@pytest.mark.parametrize(
    ("verdict", "doubtful"), [("partly_explained", True), ("unexplained", True), ("explained", False)]
)
def test_a_model_of_an_unfinished_explanation_is_doubted(
    tmp_path: Path, place: str, verdict: str, doubtful: bool
) -> None:
    (tmp_path / "m.toml").write_text(f'[{place}]\nverdict = "{verdict}"\n')
    assert bool(doubt_of_model(tmp_path / "m.toml")) is doubtful


@pytest.mark.parametrize("text", ["false", '"false"'])
def test_a_model_that_its_identification_does_not_trust_is_doubted(text: str, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(f"[model.provenance]\ntrusted = {text}\n")
    assert "is not to be trusted" in doubt_of_model(tmp_path / "m.toml")
    (tmp_path / "m.toml").write_text("[model.provenance]\ntrusted = true\n")
    assert doubt_of_model(tmp_path / "m.toml") == ""


@pytest.mark.parametrize("claim", ["explained", "adequate"])
def test_neither_verdict_stands_where_the_model_leaves_more_than_it_may(
    friction: rtctl.Diagnosis, claim: str
) -> None:
    problem, fit = friction.answer.problem, friction.answer.fits.after
    assert require_model_follows(Verdict(claim=claim), fit, problem).claim == claim
    strict = replace(problem.thresholds.verification, unfollowed=0.0, unfollowed_motion=0.0)
    problem = replace(problem, thresholds=replace(problem.thresholds, verification=strict))
    lowered = require_model_follows(Verdict(claim=claim), fit, problem)
    assert lowered.claim == "unexplained"
    assert "of the signal's RMS" in lowered.notes[-1]


@pytest.mark.parametrize(("after", "withheld"), [(0.2, False), (1.04, False), (1.06, True), (np.inf, True)])
def test_a_model_that_makes_the_loop_worse_is_withheld(
    friction: rtctl.Diagnosis, after: float, withheld: bool
) -> None:
    found = replace(friction.answer, loop=Rehearsal("self-sensing", 1.0, after, "um"))
    assert (replace(friction, answer=found).model is None) is withheld
    assert found.json["loop"] == {"scenario": "self-sensing", "before": 1.0, "after": after, "unit": "um"}
    assert ("the loop would do worse with it" in found.withheld) is withheld


def test_a_model_that_is_to_be_identified_again_is_not_extended(friction: rtctl.Diagnosis) -> None:
    loops = replace(small_model(), provenance={"trusted": "false"})
    doubt = vo2_diagnosis.VO2.doubt(loops)
    assert "acquire and identify again with holds as long" in doubt
    found = replace(friction.answer, doubt=doubt)
    assert replace(friction, answer=found).model is None
    assert "is to be identified again" in found.json["model_withheld"]
    assert vo2_diagnosis.VO2.doubt(small_model()) == friction.answer.doubt == ""


@pytest.mark.parametrize(
    ("kind", "trusted", "next_is"),
    [("vo2", True, True), ("vo2", False, False), ("oscillator", False, True), ("me", True, False)],
)
def test_a_diagnosis_comes_next_unless_data_are_to_be_acquired_again(
    kind: str, trusted: bool, next_is: bool
) -> None:
    assert is_diagnosed_next(kind, trusted=trusted) is next_is


def gain_of(output: str, low: float, high: float) -> Gain:
    """The gain of an output whose interval is `low` to `high`."""
    ratio = 0.5 * (low + high)
    return Gain(output, "", ratio, 1.0, 0.1, ratio, low, high)


@pytest.mark.parametrize(
    ("deflection", "resistance", "helps"),
    [((0.9, 1.1), (1.2, 1.4), True), ((0.7, 0.9), (1.2, 1.4), False), ((1.2, 1.4), (0.9, 1.1), False)],
    ids=["another reading gets better", "but this one worse", "this one alone"],
)
def test_a_model_helps_if_another_reading_gets_better_and_none_worse(
    deflection: tuple[float, float], resistance: tuple[float, float], helps: bool
) -> None:
    gains = [gain_of("log_resistance", *resistance), gain_of("deflection", *deflection)]
    assert falls_elsewhere(gains, [], "deflection") == helps


def test_an_error_falls_beyond_the_noise_or_it_does_not() -> None:
    noisy = Gain("deflection", "um", 2.0, 1.1, 1.0, 1.8, 1.7, 1.9)
    assert noisy.falls_to(1.5)
    assert not noisy._replace(after=1.6).falls_to(1.5)
    assert not noisy._replace(before=0.9, after=0.9).falls_to(1.5), (
        "below the noise there is nothing to remove"
    )
