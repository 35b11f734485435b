"""Runs `rtctl identify` and `rtctl diagnose` on foreign cases as a user would, and judges the answers.

python tests/foreign/foreign_campaign.py --first 0 --last 39 --workers 1 --out DIR [--style few_domains]

DIR/results.jsonl gets one line a case (a stopped campaign continues), DIR/table.md the counts by style.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from math import sqrt
from pathlib import Path
from statistics import median
from typing import Any

from foreign_styles import STYLES

LONGEST_S = 3600.0  # of one command
NAMES_ALLOWED = 2  # in `indistinguishable_from`, for the true id among them to count


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """What one case's diagnosis said, and the judgement: right | wrong | missed | failed."""

    style: str
    seed: int
    effect: str | None
    staircase: str
    share: float
    outcome: str
    verdict: str | None
    causes: list[str]
    indistinguishable: list[str]
    probability: float | None
    identify_s: float
    diagnose_s: float
    note: str


def judge(effect: str | None, diagnosis: dict[str, Any]) -> str:
    """Right, wrong (a cause that is not there) or missed (for a null: not `adequate`, but no cause either)."""
    causes = diagnosis["causes"]
    if effect is None:
        if diagnosis["verdict"] == "adequate" and not causes:
            return "right"
        return "wrong" if causes else "missed"
    if not causes:
        return "missed"
    others = causes[0].get("indistinguishable_from", [])
    if causes[0]["id"] == effect or (effect in others and len(others) <= NAMES_ALLOWED):
        return "right"
    named = {cause["id"] for cause in causes}
    named.update(name for cause in causes for name in cause.get("indistinguishable_from", []))
    return "missed" if effect in named else "wrong"


def run_case(style: str, seed: int, folder: Path) -> Case:
    """Write the case, identify and diagnose it in processes of their own."""
    here = Path(__file__).resolve().parent
    rtctl = str(Path(sys.executable).with_name("rtctl"))
    manifest, model = folder / "dataset.toml", folder / "model.toml"
    write = [sys.executable, str(here / "foreign_generate.py"), "--style", style, "--seed", str(seed)]
    identify = [rtctl, "identify", str(manifest), "--out", str(model), "--quiet", "--no-plot"]
    diagnose = [rtctl, "diagnose", str(manifest), "--model", str(model), "--out", str(folder / "out")]

    truth: dict[str, Any] = {"effect": "?", "share": 0.0, "staircase": "?"}
    seconds = [0.0, 0.0, 0.0]
    outcome, notes, diagnosis = "failed", [], None
    commands = ([*write, "--effect", "draw", "--out", str(folder)], identify, [*diagnose, "--quiet"])
    (folder / "out" / "diagnosis.json").unlink(missing_ok=True)  # of a stopped campaign
    for k, command in enumerate(commands):
        begin = time.perf_counter()
        code, said = _run(command)
        seconds[k] = time.perf_counter() - begin
        if k == 0 and code == 0:
            truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
        if code != 0:
            notes.append(f"{Path(command[0]).name} {command[1]}: exit {code}: {said[-300:]}")
        if code != 0 and (k == 0 or not model.exists()):
            break
    if (folder / "out" / "diagnosis.json").exists():
        diagnosis = json.loads((folder / "out" / "diagnosis.json").read_text(encoding="utf-8"))
        outcome = judge(truth["effect"], diagnosis)
    causes = diagnosis["causes"] if diagnosis else []
    return Case(
        style=style,
        seed=seed,
        effect=truth["effect"],
        staircase=truth["staircase"],
        share=truth["share"],
        outcome=outcome,
        verdict=diagnosis["verdict"] if diagnosis else None,
        causes=[cause["id"] for cause in causes],
        indistinguishable=causes[0].get("indistinguishable_from", []) if causes else [],
        probability=causes[0].get("probability") if causes else None,
        identify_s=round(seconds[1], 1),
        diagnose_s=round(seconds[2], 1),
        note=" | ".join(notes),
    )


def _run(command: list[str]) -> tuple[int, str]:
    """Exit code and what was said on standard error; -1 if it took too long."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_S, check=False)
    except subprocess.TimeoutExpired:
        return -1, f"stopped after {LONGEST_S:g} s"
    return done.returncode, done.stderr.strip()


def wilson(hits: int, trials: int) -> tuple[float, float]:
    """95 % interval of a share, after Wilson (1927)."""
    if trials == 0:
        return 0.0, 1.0
    z, p = 1.959964, hits / trials
    centre, scale = p + z * z / (2 * trials), 1.0 + z * z / trials
    half = z * sqrt(p * (1.0 - p) / trials + z * z / (4 * trials * trials))
    return max((centre - half) / scale, 0.0), min((centre + half) / scale, 1.0)


def table(cases: list[dict[str, Any]]) -> str:
    """Markdown table of the counts, a row for each style, one for all, and one for each kind of staircase."""
    heads = ["style", "nulls", "called wrong", "not adequate", "singles", "right", "wrong name"]
    heads += ["missed", "failed", "median s"]
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for style in [*STYLES, "all", "before the effect", "with the effect"]:
        mine = [case for case in cases if style in (case["style"], "all", case["staircase"])]
        if not mine:
            continue
        nulls = [case["outcome"] for case in mine if case["effect"] is None]
        singles = [case["outcome"] for case in mine if case["effect"] is not None]
        cells = [style, str(len(nulls)), _share(nulls, "wrong"), _share(nulls, "missed"), str(len(singles))]
        cells += [_share(singles, outcome) for outcome in ("right", "wrong", "missed")]
        cells.append(str(sum(case["outcome"] == "failed" for case in mine)))
        cells.append(f"{median(case['identify_s'] + case['diagnose_s'] for case in mine):.0f}")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _share(outcomes: list[str], wanted: str) -> str:
    hits = outcomes.count(wanted)
    if not outcomes:
        return "-"
    low, high = wilson(hits, len(outcomes))
    return f"{hits} ({100 * low:.0f} to {100 * high:.0f} %)"


def read_results(path: Path) -> list[dict[str, Any]]:
    """Cases that are done; a line that a kill cut off is dropped."""
    cases = []
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        try:
            cases.append(json.loads(line))
        except json.JSONDecodeError:
            print(f"{path}: a damaged line is left out; its case runs again", file=sys.stderr)
    return cases


def main() -> None:
    """Run the cases that are not done yet, then write the table."""
    parser = argparse.ArgumentParser(
        description="Identify and diagnose foreign VO2 cases; judge the answers."
    )
    parser.add_argument("--first", type=int, required=True)
    parser.add_argument("--last", type=int, required=True)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--style", choices=STYLES, help="only this one; default: styles in turn")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()

    results = given.out / "results.jsonl"
    given.out.mkdir(parents=True, exist_ok=True)
    cases = read_results(results)
    results.write_text("".join(json.dumps(case) + "\n" for case in cases), encoding="utf-8")
    done = {(case["style"], case["seed"]) for case in cases}
    seeds = range(given.first, given.last + 1)
    wanted = [(given.style or STYLES[seed % len(STYLES)], seed) for seed in seeds]
    with ThreadPoolExecutor(given.workers) as pool:
        runs = [
            pool.submit(run_case, style, seed, given.out / f"{style}-{seed}")
            for style, seed in wanted
            if (style, seed) not in done
        ]
        for run in as_completed(runs):
            case = asdict(run.result())
            cases.append(case)
            with results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(case) + "\n")
            told = case["causes"] or case["verdict"] or case["note"]
            print(f"{case['style']} {case['seed']}: {case['effect']}: {told}: {case['outcome']}", flush=True)
            (given.out / "table.md").write_text(table(cases), encoding="utf-8")
    (given.out / "table.md").write_text(table(cases), encoding="utf-8")
    print(table(cases))


if __name__ == "__main__":
    main()
