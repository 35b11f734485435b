"""`rtctl latency`: what was measured, what of it holds, and a sentence at the end that says which period to choose."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from rtctl.border.errors import Fault
from rtctl.cli import main
from rtctl.session.latency import Ladder, Rung, cyclictest
from rtctl.session.latency_report import conclusion, document, rows, text_histogram, verdict
from rtctl.timing.step_timing import StepTiming


def rung(period_s: float, *, missed: int = 0, busy_us: float = 100.0, fault: Fault | None = None) -> Rung:
    timing = StepTiming()
    for _ in range(2000 - missed):
        timing.step(1000, round(1e3 * busy_us) - 2000, 1000)
    timing.missed(missed)
    return Rung(
        period_s=period_s, timing=timing, fault=fault, message="silence" if fault else "", requests=()
    )


@pytest.mark.parametrize(
    ("found", "holds"),
    [
        (rung(1e-3), True),
        (rung(1e-3, missed=2), True),
        (rung(1e-3, missed=3), False),
        (rung(1e-3, busy_us=790.0), True),
        (rung(1e-3, busy_us=820.0), False),
        (rung(1e-3, fault=Fault.NO_ANSWER), False),
    ],
)
def test_a_period_holds_with_few_missed_and_a_fifth_to_spare(found: Rung, holds: bool) -> None:
    assert found.holds is holds


def test_the_held_period_is_the_shortest_before_the_first_that_is_not() -> None:
    ladder = Ladder(
        kind="serial", where="at /dev/x", rungs=(rung(2e-3), rung(1e-3), rung(5e-4, missed=50), rung(2e-4))
    )
    assert ladder.held is ladder.rungs[1]
    assert verdict(ladder) == (
        "serial (at /dev/x) holds 1 ms (1000 Hz): 0 of 2000 periods missed, 100 us of 1000 us used at the 99th "
        "percentile; "
        "0.5 ms (2000 Hz) is not held: 2.5 % of its periods were missed, at most 0.1 % may be."
    )
    none = Ladder(kind="inprocess", where="here", rungs=(rung(1e-2, fault=Fault.NO_ANSWER),))
    assert verdict(none) == "inprocess (here) does not hold 10 ms (100 Hz): no_answer, silence."
    assert "hold 1 ms (1000 Hz) over serial, no period tried over inprocess" in conclusion([ladder, none])
    assert [row[-1] for row in rows(ladder)] == ["yes", "yes", "no", "yes"]
    assert [entry["holds_period_s"] for entry in document([ladder, none], None)["drivers"]] == [1e-3, None]


def test_a_single_late_step_can_be_seen_in_the_text() -> None:
    timing = StepTiming()
    for _ in range(10_000):
        timing.lateness.record(1500)
    timing.lateness.record(90_000)
    lines = list(text_histogram("lateness", timing.lateness))
    assert lines[0] == "lateness [us], 10001 steps"
    assert lines[1].split() == ["<=", "2", "10000", 48 * "#"]
    assert lines[-1].split() == ["<=", "100", "1", "#"]


def test_the_loop_is_measured_and_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--driver", "inprocess", "--period", "4 ms", "--period", "2 ms", "--duration", "0.1 s"]
    code = main(["latency", *options, "--out", str(tmp_path)])
    text = capsys.readouterr().out
    assert code in (0, 1), "what a loaded machine holds is nobody's claim here"
    assert text.strip().splitlines()[-1].startswith("This machine and wire hold ")
    found = json.loads((tmp_path / "latency.json").read_text(encoding="utf-8"))
    (driver,) = found["drivers"]
    assert [entry["period_s"] for entry in driver["periods"]] == [0.004, 0.002]
    for entry in driver["periods"]:
        counted = entry["steps"] + entry["overruns"]
        assert counted == 200 or (counted < 200 and entry["fault"]), "a stalled machine trips the watchdog"
        assert sum(entry["histograms_us"]["round_trip"]["count"]) == entry["steps"]
        assert entry["lateness_us"]["p50"] <= entry["lateness_us"]["p99"] <= entry["lateness_us"]["max"]
    assert (tmp_path / "latency.png").stat().st_size > 10_000


@pytest.mark.skipif(shutil.which("cyclictest") is None, reason="cyclictest (rt-tests) is not installed")
def test_cyclictest_s_histogram_is_read_whole() -> None:
    histogram = cyclictest(1e-3, 0.3, None)
    assert histogram is not None
    assert histogram.count == pytest.approx(300, abs=2)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--driver", "modbus-tpc"], 'did you mean "modbus-tcp"'),
        (["--period", "1 mm"], "not compatible with s"),
        (["--duration", "0 s"], "must be > 0 s"),
        (["--period", "0"], 'period 0: must be > 0 s; write one such as "1 ms"'),
        (["--period=-1"], "must be > 0 s"),
        (["--driver", "inprocess", "--set", "clock.prioriti=80"], 'did you mean "priority"'),
    ],
)
def test_bad_options_are_told_in_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], words: str
) -> None:
    assert main(["latency", "--out", str(tmp_path), *options]) == 2
    assert words in capsys.readouterr().err
