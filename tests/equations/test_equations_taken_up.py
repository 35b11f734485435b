"""What fitted values and starts take up is said where nothing is named, and is named once these are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from equation_cases import written
from scipy.linalg import expm

import rtctl
from rtctl import Record

CART = """[model]
kind = "equations"
[model.inputs]
force = {{ unit = "N" }}
[model.states]
place = {{ unit = "mm", rate = "speed"{known} }}
speed = {{ unit = "mm/s", rate = "gain*force - drag*speed - spring*place"{known} }}
[model.outputs]
reading = {{ unit = "mm/s", value = "speed" }}
[model.parameters]
gain   = {{ value = 100.0, unit = "mm/s^2/N" }}
drag   = {{ value = 2.0, unit = "1/s", low = 0 }}
spring = {{ value = 30.0, unit = "1/s^2", low = 0 }}
"""
PERIOD_S, NOISE = 0.02, 0.05
CANDIDATES = ["input.force.offset", "state.speed.quadratic", "state.speed.leak"]


def data_of(folder: Path, pull: float) -> rtctl.Dataset:
    """Write three records of a cart on a spring that begins at rest and is pulled by a constant force [N] as well."""
    exact = expm(PERIOD_S * np.array([[0.0, 1.0, 0.0], [-30.0, -2.0, 100.0], [0.0, 0.0, 0.0]]))
    records = []
    for seed, use in ((1, "fit"), (2, "fit"), (3, "fit"), (4, "test")):
        rng = np.random.default_rng(seed)
        force = np.repeat(rng.uniform(-1.0, 1.0, 20), 15)
        state, speed = np.zeros(3), np.zeros(len(force))
        for k in range(len(force) - 1):
            state[2] = force[k] + pull
            state = exact @ state
            speed[k + 1] = state[1]
        reading = speed + NOISE * rng.standard_normal(len(force))
        signals = {"force": force, "reading": reading}
        records.append(Record(name=f"r{seed}", period_s=PERIOD_S, use=use, signals=signals))
    return rtctl.write_dataset(
        folder / "data", records, name="cart", plant="equations", units={"force": "N", "reading": "mm/s"},
        holds={"force": "zero"},
    )  # fmt: skip


@pytest.mark.parametrize("pull", [0.5, 0.0])
def test_a_pull_that_is_another_start_is_told_as_one_that_the_data_cannot_show(
    tmp_path: Path, pull: float
) -> None:
    model = written(tmp_path, CART.format(known=""))
    found = rtctl.diagnose(data_of(tmp_path, pull), model, mechanisms=CANDIDATES)
    assert found.verdict == "adequate"
    (unseen,) = [one for one in found.warnings if "cannot show" in one]
    assert "input.force.offset (taken up by the starts of the records)" in unseen
    assert "state.speed.leak (taken up by drag)" in unseen
    assert "quadratic" not in unseen
    begin = [one for one in found.warnings if "all fitted records begin at" in one]
    assert bool(begin) == bool(pull)
    if pull:
        assert "place = -1.67 mm and not 0" in begin[0]  # 0.5 N is 100/30 mm/N from the rest at 0
    seen = dict(zip(found.answer.isolability.ids, found.answer.isolability.unseen, strict=True))
    assert (
        seen["state.speed.quadratic"] < 1.0 < 1e3 < min(seen["input.force.offset"], seen["state.speed.leak"])
    )


def test_the_pull_is_named_where_the_starts_are_known(tmp_path: Path) -> None:
    model = written(tmp_path, CART.format(known=", initial = 0, fixed = true"))
    found = rtctl.diagnose(data_of(tmp_path, 0.5), model, mechanisms=CANDIDATES)
    (cause,) = found.causes
    assert (found.verdict, cause.id) == ("explained", "input.force.offset")
    assert found.model is not None
    fit = rtctl.identify(found.dataset, model=model)
    assert fit.model.content.model.states["place"].fixed
