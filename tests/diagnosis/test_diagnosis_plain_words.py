"""Names of tests in the files are read as what they look for."""

from __future__ import annotations

import pytest

from rtctl.diagnosis.report.words.plain_words import SIZE, TESTS, words_of_test


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("friction.coulomb alone", "friction.coulomb"),
        ("friction.coulomb alone, by size", "friction.coulomb" + SIZE),
        ("catalogue, by size", TESTS["catalogue"] + SIZE),
        ("generic forces", TESTS["generic forces"]),
    ],
)
def test_a_test_is_named_by_what_it_looks_for(name: str, words: str) -> None:
    assert words_of_test(name) == words
