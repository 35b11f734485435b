"""Corrections and mechanisms in a VO2 model file: kept to the bit, and every wrong key named."""

from __future__ import annotations

import pytest

from rtctl.border.errors import InputError
from rtctl.border.model_file import MechanismTable, Value
from rtctl.models.vo2_extensions import CORRECTION_UNITS, corrections_of, extension_tables, mechanisms_of
from rtctl.simulations.vo2.nominal import CORRECTIONS


def test_the_file_and_the_simulation_name_the_same_corrections() -> None:
    assert {name: declared.unit for name, declared in CORRECTIONS.items()} == CORRECTION_UNITS


def test_what_is_written_is_read_back() -> None:
    corrections = {"deflection_offset": Value(value=1.0 / 3.0, unit="um", low=0.1, high=0.5)}
    mechanisms = (MechanismTable(id="sensor.lag", parameters={"time_constant": Value(value=2.0, unit="ms")}),)
    parameters, tables = extension_tables(corrections, mechanisms)
    assert corrections_of({"other": {}, **parameters}) == corrections
    assert mechanisms_of({"mechanisms": tables}) == mechanisms
    assert extension_tables({}, ()) == ({}, [])


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"current_gain": 1.0}, 'key "model.parameters.current_gain" must be { value = <number>, unit = "dimens'),
        ({"current_offset": {"value": 1.0, "unit": "um"}}, 'unit "um" is not compatible with mA'),
        ({"current_offset": {"value": 1.0, "unt": "mA"}}, 'unknown key "unt"; did you mean "unit"?'),
    ],
)  # fmt: skip
def test_wrong_corrections_are_named(parameters: dict[str, object], words: str) -> None:
    with pytest.raises(InputError) as error:
        corrections_of(parameters)
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("mechanisms", "words"),
    [
        ({"id": "sensor.lag"}, "must be a list of tables: write [[model.mechanisms]]"),
        ([{"id": "sensor.lag"}, {"id": "sensor.lag"}], "sensor.lag is there twice"),
        ([{"ident": "sensor.lag"}], 'model.mechanisms.0: unknown key "ident"'),
    ],
)  # fmt: skip
def test_wrong_mechanisms_are_named(mechanisms: object, words: str) -> None:
    with pytest.raises(InputError) as error:
        mechanisms_of({"mechanisms": mechanisms})
    assert words in str(error.value)
