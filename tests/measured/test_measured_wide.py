"""Wide text files: what a survey of all columns costs grows with the columns, not with their square."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import rtctl
from rtctl.measured.proposal.survey import Column, survey_files
from rtctl.measured.readers import csv, open_table

ROWS, MORE = 80, 200
T = np.arange(ROWS) / 1000.0


def wide(path: Path, *, words: int = 0, separator: str = ",", comma: bool = False) -> Path:
    """t, u, x and more columns of numbers, then columns of words."""
    u = np.sin(60.0 * T) + np.sin(171.0 * T)
    columns = [T, u, np.cumsum(u), *(np.full(ROWS, float(k)) for k in range(MORE))]
    names = [*"tux", *(f"c{k}" for k in range(MORE)), *(f"w{k}" for k in range(words))]
    lines = [[f"{one[k]:.6f}" for one in columns] + ["on"] * words for k in range(ROWS)]
    text = "".join(separator.join(line) + "\n" for line in [names, *lines])
    path.write_text(text.replace(".", ",") if comma else text)
    return path


@pytest.fixture
def passes(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Columns of each pass over the numbers of a text file."""
    found: list[int] = []
    blocks = csv._blocks

    def counted(text, form, columns, kind, part):  # type: ignore[no-untyped-def]
        found.append(len(columns))
        return blocks(text, form, columns, kind, part)

    monkeypatch.setattr(csv, "_blocks", counted)
    return found


def test_all_columns_are_read_in_one_pass(tmp_path: Path, passes: list[int]) -> None:
    (survey,) = survey_files([wide(tmp_path / "r.csv")])
    assert passes == [3 + MORE]
    assert list(survey.numeric) == list(open_table(tmp_path / "r.csv").columns)


def test_columns_of_words_are_passed_over_one_by_one(tmp_path: Path, passes: list[int]) -> None:
    (survey,) = survey_files([wide(tmp_path / "r.csv", words=2)])
    assert passes[:3] == [5 + MORE, 4 + MORE, 3 + MORE]
    assert [len(survey.numeric), survey.columns["w1"].raw is None] == [3 + MORE, False]
    assert 'holds text, numbers are needed: "on"' in survey.columns["w1"].refusal


def test_more_than_fits_into_memory_takes_several_passes_and_gives_the_same(
    tmp_path: Path, passes: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = wide(tmp_path / "r.csv")
    (whole,) = survey_files([path])
    monkeypatch.setattr(csv, "TOGETHER_BYTES", 100 * 8 * ROWS)
    (parts,) = survey_files([path])
    assert passes == [203, 100, 100, 3]
    table = open_table(path)
    for name in ("t", "x", "c99", "c199"):
        np.testing.assert_array_equal(whole.columns[name].values, table.load(name, 0, ROWS))
        np.testing.assert_array_equal(parts.columns[name].values, table.load(name, 0, ROWS))


def test_decimal_commas_that_show_late_are_read(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_text("t;u;x\n" + "0;1;2\n" * 400 + "1,5;2,5;3\n")
    (survey,) = survey_files([path])
    assert [survey.columns[name].raw[-1] for name in "tux"] == [1.5, 2.5, 3.0]  # type: ignore[index]


def test_a_wrong_line_of_a_wide_file_is_found_in_one_pass(tmp_path: Path, passes: list[int]) -> None:
    path = wide(tmp_path / "r.csv")
    path.write_text(path.read_text() + "1,2\n" * 3)
    with pytest.raises(rtctl.RtctlError, match=f"line {ROWS + 2} has 2 cells, the file has 203 columns"):
        survey_files([path])
    assert len(passes) == 1


def test_the_length_of_the_columns_is_not_looked_for_with_each_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = wide(tmp_path / "r.csv")
    asked, rows = [0], Column.rows.fget

    def counted(column: Column) -> int:
        asked[0] += 1
        return rows(column)  # type: ignore[no-any-return, misc]

    monkeypatch.setattr(Column, "rows", property(counted))
    rtctl.init(path, inputs="u:V", outputs={"displacement": "x:mm"}, time="t:s", plot=False)
    assert asked[0] < 30 * (3 + MORE)
