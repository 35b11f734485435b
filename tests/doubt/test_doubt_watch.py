"""The watch of a run: quiet where nothing changes, names what does, and knows a wrong estimator from a wrong device."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import rtctl
import rtctl.session.run_files
from rtctl.cli import main
from rtctl.doubt.belief import Direction, Named, Predicted, Rows
from rtctl.doubt.naming import answer_of
from rtctl.doubt.policy import OnceActing, Policy
from rtctl.doubt.reference_windows import LENGTH, ReferenceWindows
from rtctl.doubt.sequential import ALLOWANCE, MOST, THRESHOLD, CumulativeSum
from rtctl.doubt.watch import Finding, Watch
from rtctl.plants.vo2.doubt.free_run import Vo2Belief
from rtctl.session.doubting.recorded import doubt_run
from rtctl.session.doubting.under_way import note

DEVICE = Path(__file__).resolve().parents[2] / "plant_sim" / "vo2" / "devices" / "vo2_a.toml"


@pytest.fixture(autouse=True)
def no_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rtctl.session.run_files, "draw_run", lambda *nothing: None)


def played(folder: Path, model: Path, change: str) -> Path:
    """Multisine of 22 s on device A, which changes after 12 s."""
    folder.mkdir()
    text = DEVICE.read_text(encoding="utf-8")
    file = folder / "device.toml"
    file.write_text(f'{text}\n[[changes]]\nat = "12 s"\n{change}\n' if change else text, encoding="utf-8")
    settings = [f"driver.device={file}", "driver.seed=42", "scenario.duration=22 s"]
    rtctl.run("multisine_1_10hz", model=model, settings=settings, out=folder / "run")
    return folder / "run"


def kinds(found: list[Finding]) -> list[str]:
    return [one.kind for one in found]


def test_an_unchanged_device_raises_no_alarm_and_a_wrong_estimate_is_no_change_of_it(
    tmp_path: Path, model_file: Path
) -> None:
    run = played(tmp_path / "same", model_file, "")
    assert kinds(doubt_run(run).findings) == ["learned"]

    # An estimator that is locked in: it says 54 um whatever the device does; current and resistance know better.
    table = pq.read_table(run / "signals.parquet")
    place = table.column_names.index("estimate")
    locked = table.set_column(place, table.schema.field(place), [np.full(table.num_rows, 54.0)])
    pq.write_table(locked, run / "signals.parquet")
    found = doubt_run(run, use_reference=False).findings
    assert kinds(found) == ["estimator", "learned"]
    assert found[0].sample < 4000


@pytest.mark.slow
def test_a_delay_is_noticed_within_seconds_and_named_by_command_and_reading_alone(
    tmp_path: Path, model_file: Path
) -> None:
    run = played(tmp_path / "late", model_file, 'delay = "3 ms"')
    found = doubt_run(run, use_reference=False).findings
    assert kinds(found) == ["learned", "device", "named"]
    assert 12_000 < found[1].sample < 16_500
    assert "actuation.delay" in [one.id for one in found[2].causes[:2]]


@pytest.mark.slow
def test_more_noise_is_no_change_of_the_device(tmp_path: Path, model_file: Path) -> None:
    run = played(tmp_path / "noise", model_file, "noise_growth = 8")
    found = doubt_run(run, use_reference=False).findings
    assert kinds(found)[:2] == ["learned", "noise"]
    assert "device" not in kinds(found)


def test_a_past_that_was_elsewhere_excuses_what_the_model_may_be_off() -> None:
    past = ReferenceWindows(np.array([0.01]), np.array([1.0]))
    past.add(np.zeros(2), np.array([5.0]), np.zeros(1))
    same = past.compare(np.zeros(2), np.array([6.0]))
    other = past.compare(np.array([10.0 * LENGTH, 0.0]), np.array([6.0]))
    assert same.z[0] == pytest.approx(1.0 / np.sqrt(0.01))
    assert other.z[0] == pytest.approx(1.0 / np.sqrt(1.01))


def test_one_wild_window_is_no_alarm_and_a_small_change_that_stays_is() -> None:
    sums = CumulativeSum(2)
    assert not sums.add(np.array([0.0, 1e6]))
    assert sums.sums[1] == MOST - ALLOWANCE
    sums.restart()
    windows = next(k for k in range(1, 100) if sums.add(np.array([np.nan, ALLOWANCE + 1.0])))
    assert windows == int(np.ceil(THRESHOLD))
    assert sums.windows_since == windows


def test_what_explains_nothing_is_not_named_and_what_is_as_good_is_told_beside() -> None:
    nothing = Named("", "", 0.0, "", 10.0)
    poor = Named("a", "", 0.0, "", 8.0)
    assert answer_of([nothing, poor]) == ()
    good, as_good = Named("b", "", 0.0, "", 1.0), Named("c", "", 0.0, "", 1.01)
    told = answer_of([nothing, poor, good, as_good])
    assert [one.id for one in told] == ["b", "c"]
    assert told[1].probability > 0.4


def test_policies_only_take_away_and_only_once() -> None:
    gains = {"controller.kp": 0.02, "controller.ki": 8.0}
    ended: list[bool] = []
    changed: dict[str, float] = {}

    def act(policy: Policy) -> list[str]:
        do = OnceActing(policy, lambda: gains, changed.__setitem__, lambda: ended.append(True))
        return [
            do.act(Finding(kind, 1, 0, "")) for kind in ("learned", "noise", "instrument", "device", "device")
        ]

    assert act(Policy.WARN) == [""] * 5
    assert act(Policy.DERATE)[:3] == ["", "", ""]
    assert changed == {"controller.kp": 0.01, "controller.ki": 4.0}
    assert act(Policy.STOP)[3].startswith("stop")
    assert ended == [True]


class Straight:
    """A model that is right about everything, of an output that equals its reading."""

    directions = (Direction("sensor.gain", ""),)
    reading_error, output_error, output_unit, output_width = 0.01, 0.01, "um", 1.0

    def start(self, level: float) -> None:
        pass

    def predict(self, rows: Rows) -> Predicted:
        ones = np.ones((len(rows.levels), 1))
        motion = rows.levels[:, None]
        return Predicted(rows.sensed - rows.levels, rows.levels, rows.levels, motion, ones, 0.0 * ones)

    def explain(self, rows: Rows, onset: int, before: tuple[float, float]) -> list[Named]:
        return [Named("", "", 0.0, "", 10.0), Named("sensor.gain", "offset", 1.0, "", 1.0)]

    def take(self, named: Named, sample: int) -> None:
        pass


def rows_of(begin: int, count: int, reading_off: float = 0.0, *, still: bool = False) -> Rows:
    k = np.arange(begin, begin + count, dtype=float)
    u = 0.5 + 0.4 * np.sin(2.0 * np.pi * k / 100.0)
    noise = 0.002 * np.random.default_rng(begin).standard_normal(count)
    sensed = np.full(count, 0.5) if still else u + reading_off + noise
    return Rows(k, u, np.full(count, 0.01), sensed, u + noise, u)


def test_the_reference_tells_a_sensor_from_the_device_and_a_reading_that_stands_is_stuck() -> None:
    watch = Watch(Straight(), 0.01)
    watch.restart(0.0)
    found = list(watch.feed(rows_of(0, 1500)))
    found += watch.feed(rows_of(1500, 700, 0.05))
    assert [one.kind for one in found] == ["learned", "sensor", "named"]
    watch = Watch(Straight(), 0.01)
    watch.restart(0.0)
    assert next(watch.feed(rows_of(0, 300, still=True))).kind == "sensor"


def test_where_a_reading_stands_still_nothing_else_is_named() -> None:
    """It sticks in the middle of a window, stays for the windows of a naming, and moves again."""
    watch = Watch(Straight(), 0.01)
    watch.restart(0.0)
    found = list(watch.feed(rows_of(0, 1540)))
    found += watch.feed(rows_of(1540, 1060, still=True))
    found += watch.feed(rows_of(2600, 900))
    found += watch.finish()
    assert [one.kind for one in found] == ["learned", "sensor"]
    assert found[1].message == "the reading stands still while the device must have moved"
    assert found[1].since == 1500


def test_memory_of_the_watch_is_bounded() -> None:
    watch = Watch(Straight(), 0.01)
    watch.restart(0.0)
    for begin in range(0, 40_000, 400):
        list(watch.feed(rows_of(begin, 400)))
    assert sum(len(part.samples) for part in watch._kept) <= 24 * 100
    assert watch.windows == 400


def test_a_finding_among_the_events_does_not_disturb_a_replay(tmp_path: Path, model_file: Path) -> None:
    rtctl.run("steps", model=model_file, settings=["scenario.duration=0.5 s"], out=tmp_path / "run")
    note(tmp_path / "run", Finding("device", 100, 50, "no longer"), "stop")
    last = json.loads((tmp_path / "run" / "events.jsonl").read_text().splitlines()[-1])
    assert (last["event"], last["kind"], last["done"]) == ("doubt", "device", "stop")
    assert rtctl.replay(tmp_path / "run").same


def test_the_free_run_is_the_simulation(model_file: Path) -> None:
    from rtctl.models.vo2 import read_model
    from rtctl.plants.vo2.doubt.path_run import PathRun
    from rtctl.simulations.vo2.loop_dynamics import loop_dynamics

    model = read_model(model_file)
    belief = Vo2Belief(model)
    belief.start(4.0)
    levels = np.repeat(np.array([4.0, 7.0, 5.5, 8.0, 6.0]), 200)
    rows = Rows(np.arange(1000.0), levels, np.full(1000, 1e-3), np.full(1000, 2e4), levels, levels)
    parts = [belief.predict(Rows(*(one[k : k + 250] for one in rows))).output for k in range(0, 1000, 250)]
    alone = PathRun(model, loop_dynamics(model))
    alone.start(4.0)
    whole = alone.run(levels, rows.elapsed_s, np.zeros(1000))
    np.testing.assert_array_equal(np.concatenate(parts), whole[1])
    # settled, hysteresis included: the Preisach model at the current itself
    state = model.deflection_preisach.initial_state(4.0)
    from rtctl.hysteresis.preisach.model import preisach_step

    for k, level in enumerate((4.0, 7.0, 5.5, 8.0, 6.0)):
        expected = preisach_step(state, level, model.deflection_preisach.params).y
        assert whole[1][200 * k + 199] == pytest.approx(expected, abs=1e-6)


def test_a_run_that_is_too_short_says_that_nothing_is_known(
    tmp_path: Path, model_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = ["scenario.duration=9 s", "driver.seed=42"]
    rtctl.run("multisine_1_10hz", model=model_file, settings=settings, out=tmp_path / "run")
    assert main(["doubt", str(tmp_path / "run")]) == 2
    assert "are warm-up and past, and this run has 9; run for longer than 10 s" in capsys.readouterr().out
