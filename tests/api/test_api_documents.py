"""Calls that write a file give its content as a dict, as before, with its main figures as attributes."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import json
from pathlib import Path

import pytest
from api_cases import MODEL

import rtctl
from rtctl.api.campaigns import StudyResults, SweepSummary
from rtctl.api.machines import Demonstration
from rtctl.api.runs.doubting import DoubtReport
from rtctl.api.runs.recordings import Change, Recovered
from rtctl.doubt.watch import Finding

SHORT = {"scenario.duration": "0.05 s"}


@pytest.fixture(scope="module")
def recorded(model_file: Path, tmp_path_factory: pytest.TempPathFactory) -> rtctl.Run:
    """A short run in a folder."""
    folder = tmp_path_factory.mktemp("run") / "steps"
    return rtctl.run("steps", model=model_file, settings=SHORT, out=folder, plot=False)


def test_a_doubt_that_is_too_short_says_that_nothing_is_known(recorded: rtctl.Run) -> None:
    assert recorded.folder is not None
    report = rtctl.doubt(recorded.folder)
    assert report.changed is None
    assert report.findings == ()
    assert report.path == recorded.folder / "doubt.json"
    assert isinstance(report, dict)
    assert report.items() <= json.loads(report.path.read_text()).items()
    assert "too short" in repr(report)
    assert copy.copy(report).path == report.path


def test_a_doubt_with_a_finding_says_that_something_changed() -> None:
    learned = Finding("learned", 1, 1, "new habits")
    drifted = Finding("sensor", 9, 5, "the sensor drifts")
    content = {"windows_compared": 3}
    assert DoubtReport(content, Path("doubt.json"), (learned,)).changed is False
    assert DoubtReport(content, Path("doubt.json"), (learned, drifted)).changed is True


def test_a_recovered_summary_has_figures_with_units(recorded: rtctl.Run) -> None:
    found = Recovered(recorded.summary, Path("steps"))
    assert found.steps == 50
    assert found.duration_s == pytest.approx(0.05)
    assert found.tracking == recorded.tracking
    assert found.self_sensing == recorded.self_sensing
    assert json.loads(json.dumps(found)) == recorded.summary


def test_a_change_still_unpacks_into_name_and_value() -> None:
    name, value = Change("setpoint", 30.0)
    assert (name, value) == ("setpoint", 30.0) == Change("setpoint", 30.0)


def test_a_demonstration_is_the_list_of_its_summaries(recorded: rtctl.Run) -> None:
    summary = dict(recorded.summary)
    shown = Demonstration([summary], Path("demo"))
    assert shown == [summary]
    assert shown.passed == recorded.passed
    assert shown.tracking == {summary["scenario"]: recorded.tracking}
    assert summary["scenario"] in shown._repr_html_()


def test_summaries_of_campaigns_and_studies_name_their_figures() -> None:
    content = {
        "trajectories": 1200,
        "wall_s": 2.0,
        "kind": {"in the left well": 1000},
        "least": {"nrmse": 0.01},
    }
    summary = SweepSummary(content, Path("out"))
    assert (summary.trajectories, summary.wall_s, summary.least) == (1200, 2.0, {"nrmse": 0.01})
    assert "1,200" in repr(summary)
    assert "in the left well" in summary._repr_html_()
    sections = [{"name": "one", "seconds": 1.5}, {"name": "two", "seconds": 2.0}]
    results = StudyResults({"sections": sections}, Path("out"))
    assert results.seconds == 3.5
    assert results.report == Path("out/report.html")
    assert results["sections"] == list(results.sections)


def test_a_saved_fit_stands_where_a_path_of_a_model_does(tmp_path: Path) -> None:
    (tmp_path / "model.toml").write_text(MODEL)
    model = rtctl.read_model(tmp_path / "model.toml")
    fit = rtctl.Fit(
        model=model, dataset="", method="", residual_rms={}, units={}, trusted=True, warnings=(), result=None,
        _summary={}, _draw=lambda: None,
    )  # fmt: skip
    saved = fit.save(tmp_path / "fit.toml")
    assert saved.path == Path(saved) == tmp_path / "fit.toml"
    assert rtctl.read_model(saved).parameters == model.parameters
    unsaved = rtctl.Fit(
        model=rtctl.Model(kind=model.kind, content=model.content), dataset="", method="", residual_rms={}, units={},
        trusted=True, warnings=(), result=None, _summary={}, _draw=lambda: None,
    )  # fmt: skip
    with pytest.raises(rtctl.InputError, match=r"not saved: give its `\.model`"):
        rtctl.read_model(unsaved)


def test_a_loop_is_exported_from_a_model_as_from_its_file(model_file: Path, tmp_path: Path) -> None:
    model = rtctl.read_model(model_file)
    heard: list[str] = []
    rtctl.export_c(
        "steps", model=model, out=tmp_path / "one", progress=lambda text, share: heard.append(text)
    )
    rtctl.export_c("steps", model=model_file, out=tmp_path / "other")
    files = sorted(path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*.[ch]"))
    assert files
    for name in files:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "other" / name).read_bytes()
    assert heard == ["translating the loop of steps"]


@pytest.mark.parametrize(
    "name",
    ["acquire", "demonstrate", "diagnose", "doubt", "export_c", "export_fmu", "export_mcap", "identify",
     "measure_latency", "recover", "replay", "replay_export", "reproduce_study", "run", "run_on_board", "serve_device",
     "simulate", "sweep"],
)  # fmt: skip
def test_whatever_lasts_takes_progress(name: str) -> None:
    assert inspect.signature(getattr(rtctl, name)).parameters["progress"].default is False


def test_a_run_whose_single_times_are_not_known_is_saved_all_the_same(
    recorded: rtctl.Run, tmp_path: Path
) -> None:
    """As that of the emulated board."""
    untimed = dataclasses.replace(recorded, _result=dataclasses.replace(recorded._result, timing={}))
    assert untimed.timing == {}
    folder = untimed.save(tmp_path / "again")
    assert json.loads((folder / "summary.json").read_text())["verdict"] == recorded.summary["verdict"]


def test_firmware_is_written_into_a_new_folder_and_overwrites_nothing_unasked(tmp_path: Path) -> None:
    folder = rtctl.export_firmware(tmp_path / "firmware", film="vo2_b")
    assert (folder / "Makefile").is_file()
    with pytest.raises(rtctl.InputError, match="is not empty"):
        rtctl.export_firmware(folder)
    assert rtctl.export_firmware(folder, force=True) == folder


def test_the_materials_are_those_of_the_bill(tmp_path: Path) -> None:
    listed = rtctl.list_materials()
    assert "numpy" in {one.name for one in listed.packages}
    assert json.loads(listed.save(tmp_path / "bill.json").read_text()) == listed.to_dict()
    assert listed.to_dict()["bomFormat"] == "CycloneDX"
    assert f"{len(listed.packages)} packages" in repr(listed)
