"""A number in a file has a unit or is refused in words, and a wrong key is named as the file has it."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Literal

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pydantic import Field

from rtctl.border.errors import InputError, nearest
from rtctl.border.units.quantities import Checked, Quantity, check, parse_quantity, read_toml
from rtctl.border.units.unit_text import parse_base_quantity


@pytest.mark.parametrize(
    ("raw", "unit", "value"),
    [
        ("1.8 ms", "s", 1.8e-3),
        ("1.8ms", "s", 1.8e-3),
        ({"value": 1.8, "unit": "ms"}, "s", 1.8e-3),
        ("24 degC", "kelvin", 297.15),
        ("-.5e1 um", "um", -5.0),
        ("0.05 1/(mm^2*s^2)", "1/(m^2*s^2)", 5e4),
        (0.45, "", 0.45),
        ("0.45", "", 0.45),
        ("inf mA/s", "mA/s", float("inf")),
    ],
)
def test_quantities_are_converted(raw: object, unit: str, value: float) -> None:
    assert parse_quantity(raw, unit) == pytest.approx(value)


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (1.8, '1.8 has no unit; write "1.8 s"'),
        ("1.8", "has no unit"),
        ("1.8 V", '"V" is not compatible with s'),
        ("1.8 sekunde", 'unknown unit "sekunde"'),
        ("fast", '"<number> <unit>"'),
        ("", '"<number> <unit>"'),
        (True, "quantity with its unit"),
        (None, "quantity with its unit"),
        ({"value": 1.8}, "value = <number>"),
        ({"value": "1.8", "unit": "s"}, "value = <number>"),
        ({"unit": "s"}, "value = <number>"),
    ],
)
def test_anything_else_is_refused_in_words(raw: object, words: str) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        parse_quantity(raw, "s")


@pytest.mark.parametrize(
    "raw",
    [
        "1 9**9**9 s",
        "1 s*((9)**9)**9",
        "1 10**10**8 s",
        {"value": 1.0, "unit": "9^9^9 s"},
        "1 s" + 40 * "*s/s",
    ],
)
def test_no_unit_is_worked_out_for_ever(raw: object) -> None:
    with pytest.raises(ValueError, match="cannot be read"):
        parse_quantity(raw, "s")


@pytest.mark.parametrize("raw", ["1 V^29.9e37", "2.5 ohm^2²²", "1 deg^999", "1 s^-21"])
def test_a_power_beyond_all_numbers_is_refused_in_words(raw: str) -> None:
    with pytest.raises(ValueError, match="cannot be read"):
        parse_base_quantity(raw)


@pytest.mark.parametrize("raw", ["1 √s", "1 s!", "1 s÷1", "1 ms$", "1 s,"])
def test_a_character_that_means_nothing_in_a_unit_is_not_passed_over(raw: str) -> None:
    with pytest.raises(ValueError, match="cannot be read"):
        parse_quantity(raw, "s")


@given(st.text(max_size=12))
@example("s**")
@example("(")
@example("degC/s")
@example("s^9999")
@example("'")
@example("1e999 s")
@example("__class__")
def test_no_text_makes_anything_but_a_number_or_a_sentence(unit: str) -> None:
    for raw in (f"1 {unit}", unit):
        with suppress(ValueError):
            assert isinstance(parse_quantity(raw, "s"), float)


class Circle(Checked):
    kind: Literal["circle"] = "circle"
    radius: Annotated[float, Quantity("mm")]


class Square(Checked):
    kind: Literal["square"] = "square"
    square: tuple[Annotated[float, Quantity("mm"), Field(gt=0.0)], ...]


class Page(Checked):
    shapes: tuple[Annotated[Circle | Square, Field(discriminator="kind")], ...] = ()
    width: Annotated[float, Quantity("mm"), Field(alias="w")] = 1.0


def message(**tables: object) -> str:
    with pytest.raises(InputError) as caught:
        check(Page, tables, "page.toml")
    return str(caught.value)


def test_keys_are_named_as_the_file_has_them() -> None:
    assert message(shapes=[{"kind": "circle", "radus": "1 mm", "radius": "1 mm"}]) == (
        'page.toml: unknown key "shapes.0.radus"; did you mean "radius"?'
    )
    assert message(shapes=[{"kind": "square", "square": ["1 mm", "0 mm"]}]) == (
        'page.toml: key "shapes.0.square.1": Input should be greater than 0'
    ), "a key may be called as its table's kind"
    assert message(shapes=[{"kind": "square"}]) == 'page.toml: key "shapes.0.square" is missing'
    assert message(width="1 mm") == 'page.toml: unknown key "width"; known: shapes, w', (
        "by its name in the file"
    )


def test_kinds_are_listed() -> None:
    assert message(shapes=[{"kind": "cirle"}]) == (
        'page.toml: key "shapes.0.kind": unknown kind "cirle"; known: circle, square'
    )
    assert message(shapes=[{}]) == 'page.toml: key "shapes.0.kind" is missing'


def test_every_finding_is_told_once() -> None:
    lines = message(w="1 s", x=1, shapes=[{"kind": "circle", "radius": 3}]).splitlines()
    assert len(lines) == 3
    assert all(line.startswith("page.toml: ") for line in lines)


def test_nearest() -> None:
    assert nearest("perod", ["period", "plant"]) == '; did you mean "period"?'
    assert nearest("x", ["b", "a"]) == "; known: a, b"
    assert nearest("x", []) == ""


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text("x = [")
    for path, words in (
        (tmp_path / "none.toml", "no such file"),
        (tmp_path, "is a folder"),
        (tmp_path / "bad.toml", "not valid TOML"),
        (tmp_path / "bad.toml" / "x", "cannot be read"),
    ):
        with pytest.raises(InputError) as caught:
            read_toml(path)
        assert str(caught.value).startswith(f"{path}: {words}")
