"""`rtctl diagnose` on real files: the answer, its files, what a person sees; stopping; exit codes."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from diagnosis_cases import NOISE_MM, answer_to, device, friction_case, measured, noise_drive

from rtctl.api.diagnosing import watched_search
from rtctl.border.errors import RunError
from rtctl.cli import main
from rtctl.diagnosis.diagnose import diagnose
from rtctl.diagnosis.problem.cancellation import CancellationToken
from rtctl.diagnosis.search.request import DiagnosisOptions
from rtctl.measured import open_dataset, read_dataset
from rtctl.models.oscillator import read_oscillator_model
from rtctl.output.progress import Reporter
from rtctl.session.validation.model_validation import simulation_for

FEW = "friction.coulomb,damping.quadratic,stiffness.cubic"


@pytest.fixture(scope="module")
def answered(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the friction case with results in `out`."""
    folder = tmp_path_factory.mktemp("friction")
    friction_case(folder)
    command = ["diagnose", str(folder / "dataset.toml"), "--model", str(folder / "model.toml"), "--quiet"]
    assert main([*command, "--out", str(folder / "out"), "--mechanisms", FEW]) == 0
    return folder


def test_the_answer_has_the_keys_of_the_file_formats_and_names_friction(answered: Path) -> None:
    found = json.loads((answered / "out" / "diagnosis.json").read_text())
    assert found["verdict"] == "explained"
    (cause,) = found["causes"]
    assert set(cause) == {
        "id", "statement", "kind", "probability", "parameters", "share_removed", "indistinguishable_from",
    }  # fmt: skip
    assert (cause["id"], cause["kind"]) == ("friction.coulomb", "mechanism")
    level = cause["parameters"]["level"]
    assert level["low"] < 450.0 < level["high"]
    assert {
        "metric",
        "output",
        "unit",
        "before",
        "after",
        "noise_floor",
        "ratio",
        "ratio_low",
        "ratio_high",
    } == set(found["gain"])
    assert found["gain"]["after"] < 1.1 * NOISE_MM < found["gain"]["before"]
    assert found["where"][0]["coordinate"] == "velocity_sign"
    assert found["isolability"]["ids"] == ["stiffness.cubic", "damping.quadratic", "friction.coulomb"]


def test_without_a_model_one_is_identified_first(
    answered: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["diagnose", str(answered / "dataset.toml"), "--out", str(tmp_path / "answer")]
    assert main([*command, "--mechanisms", "friction.coulomb"]) == 0
    (cause,) = json.loads((tmp_path / "answer" / "diagnosis.json").read_text())["causes"]
    assert cause["id"] == "friction.coulomb"
    model = tmp_path / "answer" / "model.toml"
    assert read_oscillator_model(model).model.parameters["stiffness"].value > 0.0
    assert f"wrote {model}" in capsys.readouterr().out


def test_the_extended_model_simulates_the_test_record_down_to_the_noise(answered: Path) -> None:
    model, problem = answered / "out" / "model-extended.toml", answered / "dataset.toml"
    assert (
        main(["simulate", str(model), str(problem), "--out", str(answered / "s"), "--quiet", "--no-plot"])
        == 0
    )
    rows = json.loads((answered / "s" / "summary.json").read_text())["records"]
    (test,) = [row for row in rows if row["use"] == "test"]
    assert test["outputs"]["displacement"]["rms_error"] < 1.1 * NOISE_MM
    provenance = read_oscillator_model(model).provenance
    assert set(provenance["sha256"]) == {"dataset.toml", "r0.csv", "r1.csv", "r2.csv"}
    assert provenance["fitted_records"] == ["r0", "r1"]


def test_the_page_needs_nothing_but_itself_and_shows_every_part(answered: Path) -> None:
    page = (answered / "out" / "report.html").read_text()
    assert not re.search(r"https?://|<script|<link|@import", page)
    sources = re.findall(r'src="([^"]{0,40})', page)
    assert len(sources) == 6
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    for text in (
        "Explained by friction.coulomb",
        "Dry friction of",
        "velocity sign",
        "Provenance",
        "damping.quadratic",
    ):
        assert text in page
    assert len(re.findall(r"<(table|figure|div|p)\b", page)) == len(
        re.findall(r"</(table|figure|div|p)>", page)
    )


def test_the_page_begins_with_what_a_design_review_asks_and_ends_with_the_method(answered: Path) -> None:
    page = (answered / "out" / "report.html").read_text()
    parts = [page.index(text) for text in (
        "Explained by friction.coulomb", "friction.coulomb, level as a drive", "RMS error of the displacement",
        "What to do", ">Evidence<", ">The model<", "natural frequency", ">Method<", "Provenance",
    )]  # fmt: skip
    assert parts == sorted(parts)
    assert "@page" in page
    figures = re.findall(r"<b>Figure (\d+)\.</b>", page)
    assert figures == [str(k) for k in range(1, 7)], "numbered as they stand"


def test_derived_quantities_are_in_the_json_and_true(answered: Path) -> None:
    found = json.loads((answered / "out" / "diagnosis.json").read_text())
    derived = {one["name"]: one for one in found["derived"]}
    assert derived["natural frequency"]["unit"] == "Hz"
    assert derived["natural frequency"]["value"] == pytest.approx(126.49 / 6.2832, rel=2e-3)
    drive = derived["friction.coulomb, level as a drive"]
    assert drive["unit"] == "V"
    assert drive["low"] < 1.0 < drive["high"]


def test_quiet_says_nothing_and_json_says_the_file(
    answered: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["diagnose", str(answered / "dataset.toml"), "--model", str(answered / "model.toml")]
    assert (
        main([*command, "--out", str(answered / "again"), "--mechanisms", "friction.coulomb", "--json"]) == 0
    )
    said = capsys.readouterr()
    assert said.err == ""
    assert json.loads(said.out) == json.loads((answered / "again" / "diagnosis.json").read_text())


@pytest.mark.slow
def test_a_log_names_the_stages_and_no_fit(answered: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["diagnose", str(answered / "dataset.toml"), "--model", str(answered / "model.toml")]
    assert main([*command, "--out", str(answered / "log"), "--mechanisms", FEW]) == 0
    said = capsys.readouterr()
    lines = said.err.splitlines()
    assert lines[0] == "diagnose bench: 0:00, the nominal model"
    assert any("causes one at a time" in one for one in lines)
    assert len(lines) < 10
    assert "friction.coulomb" not in said.err
    assert "friction.coulomb: Dry friction of" in said.out


def test_a_stopped_search_keeps_what_is_known_and_claims_no_cause(answered: Path) -> None:
    options = DiagnosisOptions()

    def report(text: str) -> None:
        if text.endswith("explain it"):
            options.cancellation.cancel()

    problem, model = answered / "dataset.toml", answered / "model.toml"
    simulation = simulation_for(model, open_dataset(problem))
    found = diagnose(
        read_dataset(problem),
        read_oscillator_model(model),
        simulation,
        ("damping.quadratic", "stiffness.cubic"),
        options,
        report,
    )
    assert found.stopped
    assert (found.verdict, found.causes) == ("unexplained", ())
    assert found.where[0].coordinate == "velocity_sign"
    assert "stopped by the user" in found.warnings[-1]
    assert {one.hypothesis.mechanisms[0] for one in found.search.rankings[0]} == {
        "damping.quadratic",
        "stiffness.cubic",
    }
    assert found.gain is not None
    assert found.gain.before > 10.0 * NOISE_MM


def test_an_interrupt_ends_the_search_at_the_next_fit(capsys: pytest.CaptureFixture[str]) -> None:
    cancellation = CancellationToken()
    with watched_search("x", cancellation, Reporter(quiet=False)) as report:
        report("first")
        assert not cancellation.cancelled
        os.kill(os.getpid(), signal.SIGINT)
        assert cancellation.cancelled
        report("second")
    said = capsys.readouterr().err
    assert "second" not in said
    assert "stopping" in said


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--false-claims", "0.7"], "below 0.5"),
        (["--mechanisms", "friction.colomb"], 'did you mean "friction.coulomb"?'),
        (["--mechanisms", ","], "name one at least"),
        (["--seconds", "-1"], "must be 0 or more"),
        (["--seconds", "nan"], "must be 0 or more"),
    ],
)
def test_wrong_options_are_said(
    answered: Path, capsys: pytest.CaptureFixture[str], options: list[str], said: str
) -> None:
    command = ["diagnose", str(answered / "dataset.toml"), "--model", str(answered / "model.toml")]
    assert main([*command, "--out", str(answered / "no"), *options]) == 2
    assert said in capsys.readouterr().err
    assert not (answered / "no").exists()


def test_what_only_the_test_records_show_is_said(tmp_path: Path) -> None:
    """Friction-free records to fit, and a test record of the same beam with a cubic spring."""
    stiff = {"id": "stiffness.cubic", "parameters": {"coefficient": {"value": 400.0, "unit": "1/(mm^2*s^2)"}}}
    plants = [(device(), 1, "fit"), (device(), 2, "fit"), (device(stiff), 3, "test")]
    records = [(noise_drive(seed), measured(plant, noise_drive(seed)), use) for plant, seed, use in plants]
    found = answer_to(tmp_path, records, FEW)
    assert found["verdict"] == "unexplained"
    assert any("the fitted records show nothing of it" in warning for warning in found["warnings"])


def test_a_stop_before_anything_is_known_is_a_message(answered: Path) -> None:
    options = DiagnosisOptions()
    options.cancellation.cancel()
    problem, model = answered / "dataset.toml", answered / "model.toml"
    simulation = simulation_for(model, open_dataset(problem))
    with pytest.raises(RunError, match="nothing was written"):
        diagnose(read_dataset(problem), read_oscillator_model(model), simulation, (), options)


def test_on_a_full_disk_the_answer_is_told_and_one_message_says_what_to_do(answered: Path) -> None:
    """A limit on the size of files stands in for the disk: the page does not fit, the extended model does."""
    command = (
        "import resource, signal, sys; from rtctl.cli import main; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
        "import rtctl.diagnosis.report.files; whole = rtctl.diagnosis.report.files.write_diagnosis\n"
        "def write(*args):\n"
        "    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, resource.RLIM_INFINITY)); return whole(*args)\n"
        "rtctl.diagnosis.report.files.write_diagnosis = write; sys.exit(main(sys.argv[1:]))"
    )
    words = ["diagnose", str(answered / "dataset.toml"), "--model", str(answered / "model.toml"), "--json"]
    words += ["--out", str(answered / "full"), "--mechanisms", "friction.coulomb"]
    done = subprocess.run(
        [sys.executable, "-c", command, *words], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert f"rtctl diagnose: {answered / 'full'}: File too large" in done.stderr
    assert "write elsewhere with --out" in done.stderr
    report = json.loads(done.stdout)
    assert report["causes"][0]["id"] == "friction.coulomb"
    assert report["provenance"]["model"] == "model.toml"
    assert not (answered / "full" / "diagnosis.json").exists()
