"""Options of a diagnosis from Python: no model, other thresholds, threads, budgets in their units."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from api_cases import write_bench

import rtctl
from rtctl.api.diagnosis_defaults import SECONDS, WORK
from rtctl.diagnosis.thresholds import Thresholds

FEW = ["stiffness.quintic", "friction.coulomb"]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with `dataset.toml` of a device with a spring of the fifth order, and `model.toml` without it."""
    return write_bench(tmp_path_factory.mktemp("bench"))


@pytest.fixture(scope="module")
def data(bench: Path) -> rtctl.Dataset:
    """The device's data."""
    return rtctl.read_dataset(bench / "dataset.toml")


def test_without_a_model_one_is_identified_first_as_by_the_command(
    data: rtctl.Dataset, tmp_path: Path
) -> None:
    diagnosis = rtctl.diagnose(data, mechanisms=FEW)
    assert diagnosis.fit is not None
    assert [cause.id for cause in diagnosis.causes] == ["stiffness.quintic"]
    folder = diagnosis.save(tmp_path / "answer")
    stored = json.loads((folder / "diagnosis.json").read_text())
    assert stored == diagnosis.to_dict(folder)
    assert "--model" not in stored["provenance"]["command"]
    assert "thresholds" not in stored["provenance"]
    identified = rtctl.read_model(folder / "model.toml")
    assert identified.parameters == diagnosis.nominal.parameters
    again = rtctl.diagnose(data, folder / "model.toml", mechanisms=FEW, threads=1)
    assert again.fit is None
    assert again.causes == diagnosis.causes


def test_a_model_of_another_origin_in_the_folder_stays(data: rtctl.Dataset, tmp_path: Path) -> None:
    diagnosis = rtctl.diagnose(data, mechanisms=FEW, work=0.0)
    (tmp_path / "model.toml").write_text("mine")
    with pytest.raises(rtctl.InputError, match=r"model\.toml"):
        diagnosis.save(tmp_path)
    assert (tmp_path / "model.toml").read_text() == "mine"
    assert not (tmp_path / "diagnosis.json").exists()


def test_replaced_thresholds_decide_and_stand_in_the_answer(data: rtctl.Dataset, bench: Path) -> None:
    own = Thresholds()
    own = replace(own, budget=replace(own.budget, one_run=1.0))
    with pytest.raises(rtctl.InputError, match="steps"):
        rtctl.diagnose(data, bench / "model.toml", thresholds=own)
    own = replace(own, budget=replace(Thresholds().budget, rivals=1.0))
    diagnosis = rtctl.diagnose(data, bench / "model.toml", mechanisms=FEW, thresholds=own)
    assert diagnosis.to_dict()["provenance"]["thresholds"] == {"budget.rivals": 1.0}


def test_wrong_options_are_named_before_anything_is_read() -> None:
    for given, words in (
        ({"thresholds": {"budget": 1}}, "thresholds must be rtctl.Thresholds, got dict"),
        ({"threads": 0}, "threads 0: 1 to 64"),
        ({"mechanisms": "no.such"}, "nowhere"),
    ):
        with pytest.raises(rtctl.InputError, match=words):
            rtctl.diagnose("nowhere.toml", **given)


def test_an_unknown_mechanism_is_refused_before_a_model_is_identified(data: rtctl.Dataset) -> None:
    with pytest.raises(rtctl.InputError, match=r'did you mean "friction\.coulomb"'):
        rtctl.diagnose(data, mechanisms="friction.coulom")


def test_the_docstring_states_the_budgets_with_their_units() -> None:
    said = " ".join((rtctl.diagnose.__doc__ or "").split())
    assert f"{WORK:.1e} unless given: a count of steps".replace("e+0", "e") in said
    assert f"[s], {SECONDS:g} unless given" in said
