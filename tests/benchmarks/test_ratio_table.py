"""The table of ratios: what got worse fails by one sentence, what repeats explain does not."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))

import ratios  # noqa: E402
from ratios import Row, Table, measured, worse  # noqa: E402

STEP = Row(
    name="step", peer="C", by="estimator_vs_c", repeats=[1.0, 1.02, 1.01], cost=101.0, peer_cost=100.0, unit="ns"
)  # fmt: skip
BEFORE = Table(
    commit="abc1234", date="2026-11-28", command="python benchmarks/ratios.py",
    machine={"cores": 2, "processor": "a processor", "load": [0.1, 1.2]}, rows=[STEP],
)  # fmt: skip


def with_repeats(*values: float) -> Table:
    """The same table with other repeats."""
    return replace(BEFORE, commit="def5678", rows=[replace(STEP, repeats=list(values))])


def test_a_ratio_that_got_worse_by_more_than_a_tenth_is_told_in_one_sentence() -> None:
    (told,) = worse(with_repeats(1.15, 1.16, 1.14), BEFORE)
    assert told.startswith("step: 1.15 x C instead of 1.01 x at abc1234 (2026-11-28), worse by 14%")
    assert "benchmarks/estimator_vs_c.py" in told


@pytest.mark.parametrize(
    "repeats",
    [
        (1.10, 1.11, 1.09),  # less than a tenth
        (1.15, 1.35, 1.05),  # its repeats differ by more
        (0.50, 0.50, 0.50),  # better
    ],
)
def test_what_is_not_worse_or_within_the_repeats_is_not_told(repeats: tuple[float, ...]) -> None:
    assert worse(with_repeats(*repeats), BEFORE) == []


def test_repeats_that_differed_then_count_as_those_that_differ_now() -> None:
    unsteady = replace(BEFORE, rows=[replace(STEP, repeats=[0.8, 1.01, 1.2])])
    assert worse(with_repeats(1.15, 1.16, 1.14), unsteady) == []


def test_a_ratio_beside_another_peer_is_not_compared() -> None:
    now = replace(BEFORE, rows=[replace(STEP, peer="C++", repeats=[2.0, 2.0, 2.0])])
    assert worse(now, BEFORE) == []


def test_the_file_gives_the_table_back() -> None:
    assert Table.read(BEFORE.text()) == BEFORE
    assert "| step | C | 101 ns | 100 ns | 1.01 | 1.00 to 1.02 |" in BEFORE.markdown()


def test_repeats_of_the_benchmarks_take_turns_and_one_that_cannot_run_is_told(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "bench_a.py").write_text(
        "from ratio import Ratio\ncalls = []\n"
        "def ratios(rounds):\n"
        "    calls.append('a')\n"
        "    return [Ratio('a', 'C', 1.0 + len(calls), 2.0, 'ns'), Ratio('pair', 'C', 3.0, 2.0, 'us', 1.25)]\n"
    )
    (tmp_path / "bench_b.py").write_text(
        "import bench_a\ndef ratios(rounds):\n    bench_a.calls.append('b')\n    raise SystemExit('needs gcc')\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    rows, left_out = measured(("bench_a", "bench_b"), 3, 15)
    assert sys.modules["bench_a"].calls == ["a", "b", "a", "a"]
    assert [(row.name, row.repeats, row.by) for row in rows] == [
        ("a", [1.0, 2.0, 2.5], "bench_a"),
        ("pair", [1.25, 1.25, 1.25], "bench_a"),
    ]
    assert left_out == ["bench_b: SystemExit: needs gcc"]


def test_each_benchmark_hands_its_ratios_over() -> None:
    for name in ratios.BENCHMARKS:
        source = (ROOT / "benchmarks" / f"{name}.py").read_text(encoding="utf-8")
        assert "def ratios(rounds: int) -> list[Ratio]:" in source, name
