"""Plants that are no oscillator, asked about as one: identified instead of refused; names judged by what is true."""

from __future__ import annotations

from pathlib import Path

import pytest
from foreign_other_plants import PLANTS, generate
from other_plants_campaign import judge

import rtctl


@pytest.mark.parametrize("plant", ["piezo_stack", "propeller_arm", "belt_drives"])
def test_a_plant_that_no_weak_form_starts_on_is_identified_as_far_as_an_oscillator_goes(
    plant: str, tmp_path: Path
) -> None:
    """All three had been refused, "the model diverges", or trusted with free runs that leave 190 % of the motion."""
    assert rtctl.identify(generate(plant, 0, tmp_path)).trusted == (plant == "piezo_stack")


def test_a_part_of_the_explanation_is_not_named_where_the_model_hardly_follows_the_motion(
    tmp_path: Path,
) -> None:
    """A counter that shows a speed without its sign: a distorted drive removes much and leaves half of the motion."""
    manifest, model = generate("belt_drives", 10, tmp_path / "data"), tmp_path / "model.toml"
    rtctl.identify(manifest).model.save(model)
    found = rtctl.diagnose(manifest, model, mechanisms="drive.harmonics").answer
    assert (found.verdict, found.causes) == ("unexplained", ())
    assert any("still leaves" in one and "of the motion" in one for one in found.warnings)


def test_every_plant_moves_and_stays_finite(tmp_path: Path) -> None:
    for name in PLANTS:
        dataset = rtctl.read_dataset(generate(name, 7, tmp_path / name))
        for record in dataset.records:
            assert record.signals["displacement"].std() > 0.0


def test_a_name_is_judged_by_what_is_true_of_the_plant() -> None:
    def line(plant: str, *causes: tuple[str, list[str]]) -> dict[str, object]:
        return {"plant": plant, "causes": list(causes), "verdict": "partly_explained"}

    assert judge(line("two_tanks")) == "no name"
    assert judge(line("two_tanks", ("drive.offset", []))) == "wrong"
    assert judge(line("propeller_arm", ("drive.delay", ["drive.lag"]))) == "true"
    assert judge(line("propeller_arm", ("drive.lag", []), ("stop.one_sided", []))) == "some true"
    assert judge(line("two_tanks") | {"verdict": "refused"}) == "refused"
