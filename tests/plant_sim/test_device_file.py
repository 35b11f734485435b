"""What a user reads when a device file is wrong: file, key, what is expected."""

from __future__ import annotations

from pathlib import Path

import pytest

from plant_sim.catalogue import bundled_plant
from rtctl.border.errors import InputError
from rtctl.wiring import load_plant

GOOD = bundled_plant("vo2_a").read_text(encoding="utf-8")


def message(folder: Path, text: str) -> str:
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_plant(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('time_constant = "1.8 ms"', 'time_const = "1.8 ms"', ["heating.time_const", "time_constant"]),
        ('time_constant = "1.8 ms"', "", ["heating.time_constant", "missing"]),
        ('time_constant = "1.8 ms"', "time_constant = 1.8", ["heating.time_constant", "no unit"]),
        ('time_constant = "1.8 ms"', 'time_constant = "1.8 mA"', ["heating.time_constant", "compatible"]),
        (
            'time_constant = "1.8 ms"',
            'time_constant = "-1.8 ms"',
            ["heating.time_constant", "greater than 0"],
        ),
        ('time_constant = "1.8 ms"', 'time_constant = "nan s"', ["heating.time_constant"]),
        ('kind = "domains"', 'kind = "domain"', ["hysteresis", "domains", "limiting-loop"]),
        ('spread = "3.2 K"', 'spred = "3.2 K"', ["spred", 'did you mean "spread"?']),
        ('mixing = "logarithmic"', 'mixing = "logaritmic"', ["resistance.mixing", '"logarithmic"']),
        ('name = "VO2-A"', 'name = "a name beyond sixteen"', ["plant.name"]),
        ('name = "VO2-A"', 'name = "µ"', ["plant.name"]),
        ('safe = "0 mA"', 'safe = "20 mA"', ["current", "safe (20.0 mA) must lie in"]),
        ('converter_range = "10 V"', 'converter_range = "2 V"', ["sensing.converter_range (2.0 V)", "ohm"]),
        ('kind = "vo2"', 'kind = "vo"', ["plant.kind", "'vo'", "vo2"]),
        ('kind = "vo2"', "", ["plant.kind", "missing", "vo2"]),
        ("[plant]", "[plant", ["not valid TOML"]),
    ],
)
def test_a_wrong_key_is_named_with_its_file(tmp_path, old, new, words):
    assert old in GOOD
    text = message(tmp_path, GOOD.replace(old, new, 1))
    assert [word for word in words if word not in text] == []


def test_every_finding_is_told_at_once(tmp_path):
    text = message(tmp_path, GOOD.replace('"1.8 ms"', '"1.8 mm"').replace('"62.32 um"', '"62 K"'))
    assert "heating.time_constant" in text
    assert "deflection.stroke" in text


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"nowhere\.toml: no such file"):
        load_plant(tmp_path / "nowhere.toml")


def test_a_misspelt_bundled_device_gets_the_nearest():
    with pytest.raises(InputError, match='did you mean "vo2_l2p"'):
        bundled_plant("vo2_lp2")
