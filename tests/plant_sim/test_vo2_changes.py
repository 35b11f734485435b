"""Changes of a simulated VO2 device while it runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from plant_sim.vo2.device_file import read_device
from plant_sim.vo2.plant import Vo2Plant
from rtctl.border.errors import InputError

DEVICE = Path(__file__).resolve().parents[2] / "plant_sim" / "vo2" / "devices" / "vo2_a.toml"


def changing(tmp_path: Path, tables: str) -> Vo2Plant:
    file = tmp_path / "device.toml"
    file.write_text(DEVICE.read_text(encoding="utf-8") + tables, encoding="utf-8")
    return Vo2Plant(read_device(file))


def test_a_change_acts_from_its_time_on_and_again_after_a_reset(tmp_path: Path) -> None:
    same = changing(tmp_path, '\n[[changes]]\nat = "1000 s"\ndelay = "1 ms"\n')
    plant = changing(tmp_path, '\n[[changes]]\nat = "20.5 ms"\ngain_loss = 0.25\n')
    for _ in range(2):
        same.reset()
        plant.reset()
        for k in range(40):
            one, other = (p.step((6.0,), 1e-3)[0][0] for p in (same, plant))
            assert one == other if k < 20 else other == pytest.approx(0.75 * one, rel=2e-3)


def test_later_changes_add_to_earlier_ones(tmp_path: Path) -> None:
    plant = changing(
        tmp_path, '\n[[changes]]\nat = "5 ms"\ndelay = "3 ms"\n[[changes]]\nat = "9 ms"\nageing = "0.1 1/s"\n'
    )
    plant.advance((6.0,), 20e-3)
    assert (plant.effects.delay, plant.effects.ageing) == (3e-3, 0.1)


def test_more_noise_leaves_the_film_alone(tmp_path: Path) -> None:
    quiet = changing(tmp_path, '\n[[changes]]\nat = "0 s"\nnoise_growth = 0.0\n')
    loud = changing(tmp_path, '\n[[changes]]\nat = "0 s"\nnoise_growth = 50.0\n')
    readings = [[p.step((6.0,), 1e-3)[0][0] for _ in range(300)][100:] for p in (quiet, loud)]
    spread = [max(r) - min(r) for r in readings]
    assert spread[1] > 5.0 * spread[0]
    assert loud.resistance_ohm == quiet.resistance_ohm


@pytest.mark.parametrize(
    ("tables", "says"),
    [
        (
            '\n[[changes]]\nat = "2 s"\ndelay = "1 ms"\n[[changes]]\nat = "1 s"\ndelay = "2 ms"\n',
            "must be later",
        ),
        ('\n[[changes]]\nat = "2 s"\n', "names no effect"),
        ('\n[[changes]]\nat = "2 s"\ndelai = "1 ms"\n', "delay"),
    ],
)
def test_a_wrong_change_is_refused_with_what_to_do(tmp_path: Path, tables: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        changing(tmp_path, tables)
