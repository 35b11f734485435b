"""A study's frame: a finished step is kept, an unfinished one runs again; the report has every figure."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rtctl.plots.elements.style import house_style, new_figure, save_png
from rtctl.reproduce.report import write_report
from rtctl.reproduce.run import run_study
from rtctl.reproduce.study import (
    Comparison,
    Picture,
    Row,
    Run,
    Section,
    Step,
    Study,
    Table,
    as_json,
    from_json,
)

ROWS = (
    Row(quantity="mean error", unit="um", paper=1.1, ours=0.55),
    Row(quantity="size of loops", unit="%", paper=None, ours=4.0, note="the paper has no number"),
)


def drawn(run: Run) -> Section:
    with house_style():
        figure = new_figure(2.0, 2.0)
        figure.subplots().plot([0.0, 1.0])
    save_png(figure, run.pictures / "line.png")
    return Section(
        title="Tracking",
        text="Steps.\n\nAnd a <sine>.",
        parts=(
            Comparison(title="Errors", rows=ROWS),
            Table(title="By level", headers=("levels", "error"), rows=(("6", "1.0"),), numbers=(0, 1)),
            Picture(file="line.png", caption="A line.", alt="a line"),
        ),
    )


def study(*steps: Step) -> Study:
    return Study(
        name="toy",
        title="A study",
        paper="Nobody 2020",
        lead="On no plant.",
        steps=steps,
        faults=("A sign.",),
    )


def test_a_section_is_plain_data(tmp_path: Path) -> None:
    section = drawn(Run(out=tmp_path, pictures=tmp_path, short=True))
    assert from_json(json.loads(json.dumps(as_json(section)))) == section


def test_a_stopped_study_goes_on_where_it_was(tmp_path: Path) -> None:
    calls: list[str] = []

    def counted(run: Run) -> Section:
        calls.append("first")
        return drawn(run)

    def stopped(run: Run) -> Section:
        calls.append("second")
        if calls.count("second") == 1:
            raise KeyboardInterrupt
        return Section(title="Second", text="")

    toy = study(Step("one", counted), Step("two", stopped))
    with pytest.raises(KeyboardInterrupt):
        run_study(toy, tmp_path, short=True, report=calls.append)
    found = run_study(toy, tmp_path, short=True, report=lambda line: None)
    assert [section.title for section, _ in found] == ["Tracking", "Second"]
    assert calls.count("first") == 1

    (tmp_path / "pictures" / "line.png").unlink()
    run_study(toy, tmp_path, short=True, report=lambda line: None)
    assert calls.count("first") == 2  # its picture is gone
    run_study(toy, tmp_path, short=False, report=lambda line: None)
    assert calls.count("first") == 3  # a short section is none of a full report


def test_the_report_has_every_figure_beside_the_papers(tmp_path: Path) -> None:
    toy = study(Step("one", drawn))
    sections = run_study(toy, tmp_path, short=True, report=lambda line: None)
    write_report(toy, sections, tmp_path, "rtctl reproduce toy", "2020-01-01")
    text = (tmp_path / "report.md").read_text()
    assert "| mean error | um | 1.1 | 0.55 | 0.5 |  |" in text
    assert "| size of loops | % | – | 4 | – | the paper has no number |" in text
    assert "![a line](pictures/line.png)" in text
    assert "- A sign." in text
    page = (tmp_path / "report.html").read_text()
    assert "data:image/png;base64," in page
    assert "And a &lt;sine&gt;." in page
    results = json.loads((tmp_path / "results.json").read_text())
    assert results["sections"][0]["parts"][0]["rows"][0]["ratio"] == 0.5


def test_a_row_of_a_table_that_has_too_few_cells_is_known_at_once() -> None:
    with pytest.raises(ValueError, match="2 headers, but a row of 1"):
        Table(title="t", headers=("a", "b"), rows=(("1",),))
