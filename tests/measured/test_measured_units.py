"""No text in a unit field ends in a traceback, and a column converts as pint converts one number."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rtctl.measured.units import check_unit, convert_column

FRAGMENTS = [
    "m",
    "s",
    "V",
    "furlong",
    "??",
    "^",
    "**",
    "/",
    "(",
    ")",
    "2",
    "-",
    " ",
    "'",
    '"',
    "\\",
    "\n",
    "µ",
    "%",
]


@given(st.one_of(st.text(max_size=12), st.lists(st.sampled_from(FRAGMENTS), max_size=6).map("".join)))
def test_any_text_is_a_unit_or_a_readable_refusal(text: str) -> None:
    try:
        check_unit(text)
    except ValueError as error:
        assert "unit" in str(error)  # noqa: PT017 - most texts are refused, some are units


@pytest.mark.parametrize(
    ("value", "unit", "to", "expected"),
    [
        (2.0, "kohm", "ohm", 2000.0),
        (5.0, "mA", "mA", 5.0),
        (1.0, "inch", "um", 25400.0),
        (25.0, "degC", "K", 298.15),
        (3.0, "µm", "um", 3.0),
        (1.0, "kΩ", "ohm", 1000.0),
    ],
)
def test_columns_convert(value: float, unit: str, to: str, expected: float) -> None:
    np.testing.assert_allclose(convert_column(np.array([value, value]), unit, to), expected, rtol=1e-12)


def test_a_misspelt_unit_is_told_with_the_nearest_common_one() -> None:
    with pytest.raises(ValueError, match=r'unknown unit "ohmm"; did you mean "ohm"\?'):
        check_unit("ohmm")
