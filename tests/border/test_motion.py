"""Units of a motion of which a derivative was measured."""

from __future__ import annotations

import pytest

from rtctl.border.motion import held_response, with_displacement


@pytest.mark.parametrize(
    ("signal", "unit", "held", "displacement"),
    [
        ("displacement", "um", "um", "um"),
        ("velocity", "mm/s", "mm/s", "mm"),
        ("velocity", "um/ms", "m/s", "m"),
        ("velocity", "deg/s", "deg/s", "deg"),
        ("velocity", "rpm", "rad/s", "rad"),
        ("velocity", "V", "V", "s*V"),
        ("acceleration", "m/s^2", "m/s^2", "m"),
        ("acceleration", "g_0", "m/s^2", "m"),
        ("acceleration", "V", "V", "s**2*V"),
    ],
)
def test_a_response_is_held_so_that_lengths_have_a_plain_unit(
    signal: str, unit: str, held: str, displacement: str
) -> None:
    assert held_response(signal, unit) == held
    assert held_response(signal, held) == held
    assert with_displacement({"drive": "V", signal: unit})["displacement"] == displacement


def test_units_without_a_response_stay_as_they_are() -> None:
    assert with_displacement({"current": "mA", "deflection": "um"}) == {"current": "mA", "deflection": "um"}
