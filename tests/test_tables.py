"""Tables fit the width of the terminal, 80 columns in a pipe, and no cell is cut."""

from __future__ import annotations

import pytest

from rtctl.output.tables import print_table, split_columns

HEADERS = [
    "record",
    "use",
    "output",
    "RMS error",
    "RMS signal",
    "error of signal",
    "largest error",
    "integrator",
]
ROWS = [
    ["up_03", "test", "displacement", "149.4 um", "3372 um", "44.3 %", "385.2 um", "2e-12 %"],
    ["noise", "fit", "velocity", "0.4 mm/s", "–", "4.3 %", "85.2 mm/s", "3e-12 %"],
]


def test_a_table_shows_every_cell_even_what_looks_like_markup(capfd: pytest.CaptureFixture[str]) -> None:
    print_table("run: pass [mA]", ["", "mean abs [um]"], [["tracking", "0.123"], ["self [1]", "–"]])
    out = capfd.readouterr().out
    for text in ("run: pass [mA]", "mean abs [um]", "tracking", "0.123", "self [1]", "–"):
        assert text in out


@pytest.mark.parametrize("repeats", [1, 3])
def test_a_wide_table_goes_on_below_and_every_cell_is_whole(
    capfd: pytest.CaptureFixture[str], repeats: int
) -> None:
    rows = [[row[0], *(repeats * row[1:])] for row in ROWS]
    print_table("a table", [HEADERS[0], *(repeats * HEADERS[1:])], rows)
    lines = capfd.readouterr().out.splitlines()
    assert max(len(line.rstrip()) for line in lines) <= 80
    for row in ROWS:
        for cell in row[1:]:
            assert sum(cell in line for line in lines) >= repeats
    blocks = sum("up_03" in line for line in lines)
    assert blocks == len(split_columns([HEADERS[0], *(repeats * HEADERS[1:])], rows, 80))
    assert (blocks > 1) == (repeats > 1)


def test_a_sentence_is_folded_between_its_words(capfd: pytest.CaptureFixture[str]) -> None:
    sentence = "two hysteresis read-outs of temperature, combined into one estimate of the deflection"
    print_table("", ["name", "what it is", "for"], [["composite", sentence, "vo2"]])
    lines = capfd.readouterr().out.splitlines()
    assert max(len(line.rstrip()) for line in lines) <= 80
    words = " ".join(line[len("composite") : -len("vo2")] for line in lines[2:]).split()
    assert words == sentence.split()


def test_numbers_stand_under_one_another_and_are_not_folded(capfd: pytest.CaptureFixture[str]) -> None:
    print_table("", ["name", "value"], [["a", "1 um"], ["b", "12345 um"]])
    first, second = [line.rstrip() for line in capfd.readouterr().out.splitlines() if line[:1] in "ab"]
    assert len(first) == len(second)
