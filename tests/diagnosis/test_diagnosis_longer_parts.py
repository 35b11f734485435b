"""Causes that explain initial parts of records let the model follow further: what acts only there is found too."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from diagnosis_cases import UNITS, FloatArray, answer_to, cause, device, measured, noise_drive, write_case

from rtctl.diagnosis.diagnose import diagnose
from rtctl.diagnosis.nominal_fit.nominal_fit import NominalFit
from rtctl.diagnosis.problem.cancellation import CancellationToken
from rtctl.diagnosis.search.record_parts.longer_parts import as_initial_parts
from rtctl.diagnosis.search.request import DiagnosisOptions
from rtctl.measured import read_dataset
from rtctl.models.oscillator import read_oscillator_model
from rtctl.wiring_models import build_simulation

SAMPLES, SOFT = 3000, 1500
LATE_S, PLACE_MM, STIFFNESS = 5e-3, 1.2, 6e4
IDS = "timing.skew,stop.one_sided,stiffness.cubic,damping.quadratic,drive.lag"


def records(later: float, at_first: float = 1.0) -> list[tuple[FloatArray, FloatArray, str]]:
    """Records that are read late; from their middle on the drive is larger, and the motion reaches a stop."""
    skew = cause("timing.skew", late=(LATE_S, "s"))
    stop = cause("stop.one_sided", above=(STIFFNESS, "1/s^2"), place=(PLACE_MM, "mm"))
    hidden = device(skew, stop, damping=(4.0, "1/s"))
    grows = np.where(np.arange(SAMPLES) < SOFT, at_first, later)
    drives = [
        (grows * noise_drive(seed, 2.0, SAMPLES), use) for seed, use in ((1, "fit"), (2, "fit"), (3, "test"))
    ]
    reached = np.abs(measured(device(damping=(4.0, "1/s")), drives[0][0], 0.0)[:SOFT]).max()
    assert (reached > PLACE_MM) == (at_first > 1.0)
    return [(drive, measured(hidden, drive), use) for drive, use in drives]


def answer(folder: Path, later: float) -> dict[str, Any]:
    """The diagnosis of such records."""
    return answer_to(folder, records(later), IDS)


def test_a_stop_behind_late_readings_is_found_where_the_model_follows_with_them(tmp_path: Path) -> None:
    """The readings are so late that the nominal model leaves the records before the motion reaches the stop."""
    found = answer(tmp_path, 3.0)
    assert found["verdict"] == "explained"
    late, stop = sorted(found["causes"], key=lambda cause: cause["id"], reverse=True)
    assert (late["id"], stop["id"]) == ("timing.skew", "stop.one_sided")
    assert late["parameters"]["late"]["value"] == pytest.approx(LATE_S, rel=1e-3)
    assert stop["parameters"]["place"]["value"] == pytest.approx(PLACE_MM, rel=2e-3)
    assert stop["parameters"]["above"]["value"] == pytest.approx(STIFFNESS, rel=0.02)
    assert found["gain"]["ratio_low"] > 20.0
    assert late["share_removed"] + stop["share_removed"] == pytest.approx(1.0, abs=1e-3)
    assert stop["share_removed"] > 0.02, "what late readings cost in shorter parts is no share of these"
    assert any("with timing.skew the model follows" in text for text in found["warnings"])


def test_longer_parts_that_need_no_more_causes_determine_the_same_ones(tmp_path: Path) -> None:
    found = answer(tmp_path, 1.0)
    assert found["verdict"] == "explained"
    assert [cause["id"] for cause in found["causes"]] == ["timing.skew"]
    assert found["gain"]["ratio_low"] > 20.0


def test_a_stop_has_no_more_parameters_in_longer_parts(tmp_path: Path) -> None:
    """A model that is followed further is fitted whole: the stop had a second side of 0.3 1/s^2."""
    found = answer_to(tmp_path, records(3.0, at_first=3.0), IDS)
    assert found["verdict"] == "explained"
    assert any("the model follows" in text for text in found["warnings"])
    causes = {cause["id"]: cause["parameters"] for cause in found["causes"]}
    assert set(causes) == {"timing.skew", "stop.one_sided"}
    stop = {name: one["value"] for name, one in causes["stop.one_sided"].items() if one["value"] != 0.0}
    assert stop == pytest.approx({"above": STIFFNESS, "place": PLACE_MM}, rel=0.01)


def test_longer_parts_that_end_where_the_motion_is_unpredictable_are_initial_ones_still() -> None:
    """A fit to whole records left 81 % of a motion between stops, and causes that leave noise were withdrawn."""
    part, longer_part, whole, fit = (cast(Any, object()) for _ in range(4))
    first = NominalFit(part, fit, (whole, fit), (), parted=True)
    unpredictable = NominalFit(longer_part, fit, (longer_part, fit), ())
    joined = as_initial_parts(unpredictable, first)
    assert joined.problem is longer_part
    assert joined.whole == (whole, fit)
    assert joined.parted


def test_rivals_that_longer_parts_do_not_tell_apart_stay(tmp_path: Path) -> None:
    """A constant of the reading is one of the drive where the spring is straight."""
    read = [(drive, displacement + 0.1, use) for drive, displacement, use in records(1.0)]
    found = answer_to(tmp_path, read, f"{IDS},sensor.offset,drive.offset")
    assert any("the model follows" in text for text in found["warnings"])
    late, constant = sorted(found["causes"], key=lambda cause: cause["id"], reverse=True)
    assert late["id"] == "timing.skew"
    assert {constant["id"], *constant["indistinguishable_from"]} == {"sensor.offset", "drive.offset"}


def test_one_may_stop_while_the_model_is_followed_further(tmp_path: Path) -> None:
    manifest, token = write_case(tmp_path, records(3.0)), CancellationToken()

    def report(text: str) -> None:
        if text.startswith("the records as far as the model follows"):
            token.cancel()

    data, model = read_dataset(manifest), read_oscillator_model(tmp_path / "model.toml")
    options = DiagnosisOptions(threads=1, cancellation=token)
    found = diagnose(
        data, model, build_simulation(model, UNITS, "model.toml"), IDS.split(","), options, report
    )
    assert found.stopped
    assert [cause.id for cause in found.causes] == ["timing.skew"]
