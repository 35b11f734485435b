"""`retune`: the cause that senses best takes over on trial, stays if the measured error falls, else is taken back."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from vo2_model_cases import small_model

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.doubt.belief import MemoryBefore, Rows
from rtctl.doubt.naming import Answer
from rtctl.doubt.watch import Finding
from rtctl.models.vo2 import read_model
from rtctl.plants.vo2.doubt.free_run import Vo2Belief
from rtctl.plants.vo2.doubt.path_run import PathRun
from rtctl.plants.vo2.doubt.retuned import retuned_model
from rtctl.scenario.schema import load_scenario
from rtctl.session.doubting.retuning import Retuning
from rtctl.session.live.successors import read_onset
from rtctl.simulations.vo2.loop_dynamics import loop_dynamics

SCENARIO = Path(__file__).resolve().parents[2] / "scenarios" / "multisine_1_10hz.toml"
PERIOD_S = 0.01
LOST = -0.1
"""Part of the sensor's gain that is lost."""


def answer(identity: str, size: float, probability: float = 0.5) -> Answer:
    return Answer(identity, identity, size, "", probability, 0.9)


def rows(seconds: float, tracking_um: float, begin: int = 0) -> dict[str, FloatArray]:
    """A device that is the small model, but for its sensor; it stays `tracking_um` off its set-point."""
    index = np.arange(begin, begin + round(seconds / PERIOD_S), dtype=np.float64)
    current = 6.3 + 1.9 * np.sin(2.0 * np.pi * PERIOD_S * index)
    path = PathRun(small_model(), loop_dynamics(small_model()))
    path.start(3.7)
    log_read, bent, _ = path.run(current, np.full(len(index), PERIOD_S), np.zeros(len(index)))
    return {
        "index": index, "setpoint": bent + tracking_um, "estimate": bent, "current": current,
        "resistance": (1.0 + LOST) * np.exp(log_read), "deflection": bent,
    }  # fmt: skip


class Asked:
    """A retuning of a run in `folder`, and which models it asked for."""

    def __init__(
        self, folder: Path, *, use_reference: bool, memory_before: MemoryBefore = lambda sample: None
    ) -> None:
        scenario, _ = load_scenario(SCENARIO, [f"scenario.period={PERIOD_S} s"])
        self.models: list[int] = []
        self.folder, self.newest, self.late = folder, 0, 0
        self.refuses = False
        self.retuning = Retuning(
            folder, scenario, small_model(), self._change, memory_before, use_reference=use_reference
        )

    def _change(self, number: int) -> str:
        if self.refuses:
            raise InputError("the margins are out of reach")
        self.models.append(number)
        event = {"step": self.newest + 1 + self.late, "event": "model", "number": number, "since": 0}
        with (self.folder / "events.jsonl").open("a") as events:
            events.write(json.dumps(event) + "\n")
        return "PI"

    def see(self, table: Mapping[str, FloatArray]) -> list[Finding]:
        self.newest = int(table["index"][-1])
        return list(self.retuning.see(table))

    def name(self, *causes: Answer) -> str:
        return self.retuning.act(Finding("named", 1199, 300, "", causes))


@pytest.fixture
def asked(tmp_path: Path) -> Asked:
    made = Asked(tmp_path, use_reference=True)
    assert made.see(rows(12.0, 2.0)) == []
    return made


def test_the_cause_that_senses_best_takes_over_and_stays_if_the_error_falls(
    asked: Asked, tmp_path: Path
) -> None:
    said = asked.name(answer("actuation.delay", 2e-3), answer("sensor.gain", 0.8 * LOST))
    assert asked.models == [1]
    assert "in the rehearsal sensor.gain brings the estimate's error" in said
    offset = read_model(tmp_path / "retuned-1.toml").corrections["resistance_offset"].value
    assert offset == pytest.approx(math.log(1.0 + LOST), abs=0.01), "the size is refined in the rehearsal"
    assert asked.name(answer("sensor.gain", LOST)) == "", "one trial at a time"
    assert asked.see(rows(8.0, 0.5, 1200)) == []
    verdict, = asked.see(rows(2.0, 0.5, 2000))  # fmt: skip
    assert verdict.kind == "retuned"
    assert "mean tracking error 2 -> 0.5 um" in verdict.message
    assert asked.models == [1]


def test_a_trial_in_which_the_error_does_not_fall_is_taken_back(asked: Asked) -> None:
    asked.name(answer("sensor.gain", LOST))
    verdict, = asked.see(rows(9.5, 2.1, 1200))  # fmt: skip
    assert verdict.kind == "rolled_back"
    assert verdict.message.endswith("model.toml takes over again")
    assert asked.models == [1, 0]


def test_what_the_loop_refuses_or_has_no_place_for_changes_nothing(asked: Asked) -> None:
    assert "no place in estimator and tuning" in asked.name(answer("thermal.ambient_drift", 0.05, 1.0))
    assert "which is no gain" in asked.name(answer("sensor.lag", 0.02))
    assert asked.retuning.act(Finding("device", 1199, 300, "")) == ""
    asked.refuses = True
    assert asked.name(answer("sensor.gain", LOST)) == "retune: not done: the margins are out of reach"
    assert asked.models == []
    assert asked.see(rows(9.5, 2.1, 1200)) == [], "no trial, no verdict"


def test_without_the_reference_a_cause_must_stand_alone(tmp_path: Path) -> None:
    asked = Asked(tmp_path, use_reference=False)
    asked.see(rows(12.0, 2.0))
    said = asked.name(answer("actuation.delay", 2e-3), answer("sensor.lag", 2e-3))
    assert "only the reference instrument could tell" in said
    assert asked.models == []
    asked.name(answer("sensor.gain", LOST, 0.95))
    assert asked.models == [1]
    verdict, = asked.see(rows(9.5, 0.4, 1200))  # fmt: skip
    assert verdict.kind == "retuned"
    assert verdict.message.endswith("by the new model's free run")


def test_causes_add_up_in_the_model() -> None:
    delay, second = answer("actuation.delay", 1e-3), answer("thermal.second_time_constant", 0.3)
    model = retuned_model(
        small_model(), [delay, delay, answer("sensor.gain", LOST), second._replace(shape=6e-3)]
    )
    assert loop_dynamics(model).delay_s == pytest.approx(2e-3)
    assert loop_dynamics(model).balance.second_time_constant_s == pytest.approx(6e-3)
    with pytest.raises(InputError):
        retuned_model(small_model(), [answer("actuation.delay", -1e-3)])


def error_since(
    asked: Asked, change_s: float, before_um: float, after_um: float, until_s: float = 12.0
) -> None:
    """Let the run be seen whose tracking error changes."""
    asked.see(rows(change_s, before_um))
    whole = rows(until_s, after_um)
    asked.see({name: column[round(change_s / PERIOD_S) :] for name, column in whole.items()})


def test_nothing_is_tried_while_the_error_has_hardly_grown_and_it_is_once_it_has(tmp_path: Path) -> None:
    asked = Asked(tmp_path, use_reference=True)
    error_since(asked, 8.0, 2.0, 2.1)
    finding = Finding("named", 1199, 800, "the sensor reads less", (answer("sensor.gain", LOST),))
    said = asked.retuning.act(finding)
    assert said.startswith("retune: not done: the mean tracking error has hardly grown, 2 -> 2.1 um")
    assert asked.models == []
    assert asked.see(rows(1.0, 2.1, 1200)) == []
    again, = asked.see(rows(3.0, 3.0, 1300))  # fmt: skip
    assert again.message == "the mean tracking error has grown since, 2 -> 3 um: the sensor reads less"
    assert "takes over on trial" in asked.retuning.act(again)
    assert asked.models == [1]


def test_a_drift_is_kept_where_going_back_would_be_worse(asked: Asked) -> None:
    asked.name(answer("sensor.gain", LOST))
    verdict, = asked.see(rows(9.5, 2.1, 1200))  # fmt: skip
    assert verdict.kind == "rolled_back", "the small model senses to less than 2.1 um"
    assert "the model before would sense" in verdict.message
    asked = Asked(asked.retuning._folder, use_reference=True)
    asked.see(rows(12.0, 0.01))
    asked.name(answer("sensor.gain", LOST))
    verdict, = asked.see(rows(9.5, 0.02, 1200))  # fmt: skip
    assert verdict.kind == "retuned", "the model before senses worse than the loop tracks"


def test_a_resistance_that_drifts_is_followed_from_the_newest_onset_on() -> None:
    drift, delay = answer("sensor.ageing", 0.005), answer("actuation.delay", 1e-3)
    model = retuned_model(small_model(), [drift, delay], [20.0, 0.0])
    dynamics = loop_dynamics(model)
    assert math.exp(-dynamics.reading.offset) == pytest.approx(1.1)
    assert dynamics.ageing == pytest.approx(0.005 / 1.1)
    assert dynamics.ageing_slowing_s > 0.0, "nobody knows how long it goes on"
    with pytest.raises(InputError, match="leaves no resistance"):
        retuned_model(small_model(), [answer("sensor.ageing", -0.1)], [20.0])


def test_the_films_memory_before_the_change_goes_to_the_model_that_takes_over(tmp_path: Path) -> None:
    belief = Vo2Belief(small_model())
    asked = Asked(tmp_path, use_reference=True, memory_before=belief.memory_before)
    belief.start(3.7)
    table, later = rows(24.0, 2.0), rows(24.0, 3.0)
    table["setpoint"][1500:] = later["setpoint"][1500:]
    for begin in range(0, 2400, 100):
        part = {name: column[begin : begin + 100] for name, column in table.items()}
        seen = (part["index"], part["current"], np.full(100, PERIOD_S), part["resistance"])
        belief.predict(Rows(*seen, part["deflection"], part["deflection"]))
    asked.see(table)
    finding = Finding("named", 2399, 1500, "", (answer("sensor.gain", LOST),))
    assert "takes over on trial" in asked.retuning.act(finding)
    onset = read_onset(tmp_path, 1)
    assert onset is not None
    assert onset.memory is not None
    assert (onset.before, onset.until, onset.at) == (0, 1500, 700), "8 s before the change, at a window's end"
    run = PathRun(small_model(), loop_dynamics(small_model()))
    run.start(3.7)
    run.run(table["current"][:700], np.full(700, PERIOD_S), np.zeros(700))
    for one, other in zip(onset.memory, run.film_memory(), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)


def test_a_trial_begins_when_the_model_takes_over_not_when_it_was_asked_for(asked: Asked) -> None:
    """A live loop prepares it for seconds; what is tracked until then is the model before's."""
    asked.late = 900
    asked.name(answer("sensor.gain", LOST))
    assert asked.see(rows(9.0, 2.1, 1200)) == [], "9 s of the model before are no trial"
    assert asked.see(rows(8.0, 0.5, 2100)) == []
    verdict, = asked.see(rows(1.5, 0.5, 2900))  # fmt: skip
    assert verdict.kind == "retuned"
    assert "mean tracking error 2 -> 0.5 um" in verdict.message


def test_a_model_that_never_takes_over_ends_the_trial(asked: Asked) -> None:
    asked.late = 10**6
    asked.name(answer("sensor.gain", LOST))
    verdict, = asked.see(rows(61.0, 2.1, 1200))  # fmt: skip
    assert verdict.message == "retuned-1.toml has not taken over in 60 s"


def test_at_a_second_change_the_films_memory_is_that_of_the_estimator_in_force(asked: Asked) -> None:
    asked.name(answer("sensor.gain", LOST))
    verdict, = asked.see(rows(10.0, 0.5, 1200))  # fmt: skip
    assert verdict.kind == "retuned"
    table, later = rows(42.0, 0.5), rows(42.0, 3.0)
    table["setpoint"][3600:] = later["setpoint"][3600:]
    for begin in range(2200, 4200, 50):
        asked.see({name: column[begin : begin + 50] for name, column in table.items()})
    finding = Finding("named", 4199, 3600, "", (answer("sensor.gain", 0.02),))
    asked.retuning._try(finding, asked.retuning._joined())
    onset = read_onset(asked.folder, 2)
    assert onset is not None
    assert onset.memory is not None
    assert (onset.before, onset.until) == (1, 3600)
    assert 2750 <= onset.at <= 2800, "8 s before the change, to half a second"
    run = PathRun(small_model(), loop_dynamics(small_model()))
    run.start(3.7)
    run.run(table["current"][: onset.at], np.full(onset.at, PERIOD_S), np.zeros(onset.at))
    assert onset.memory.power == pytest.approx(run.film_memory().power, rel=0.01)
