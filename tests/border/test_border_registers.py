"""The words of the register map: high word first, float32, and back."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rtctl.border.wire.registers import (
    float32_words,
    identity_words,
    uint32_words,
    words_float32,
    words_identity,
    words_uint32,
)


def test_high_word_first_by_hand() -> None:
    assert float32_words(1.0) == (0x3F80, 0x0000)
    assert float32_words(-8.49) == struct.unpack(">HH", bytes.fromhex("c107d70a"))
    assert uint32_words(0x12345678) == (0x1234, 0x5678)
    assert identity_words("VO2-A")[:3] == [0x564F, 0x322D, 0x4100]


@given(st.floats(width=32))
def test_float32_survives(value: float) -> None:
    back = words_float32(*float32_words(value))
    assert back == value or (math.isnan(back) and math.isnan(value))


def test_what_is_beyond_float32_is_refused() -> None:
    with pytest.raises(OverflowError):
        float32_words(1e39)


@given(st.integers(0, 2**40))
def test_uint32_wraps(value: int) -> None:
    assert words_uint32(*uint32_words(value)) == value % 2**32


@given(st.text(st.characters(min_codepoint=33, max_codepoint=126), max_size=20))
def test_an_identity_is_sixteen_ascii_characters(name: str) -> None:
    words = identity_words(name)
    assert len(words) == 8
    assert words_identity(words) == name[:16]
