"""Runs `rtctl identify` and `rtctl diagnose` on foreign cases as a user would, and judges the answers.

python tests/foreign/foreign_campaign.py --first 0 --last 39 --workers 1 --out DIR [--style few_domains]
python tests/foreign/foreign_campaign.py --kind oscillator --effects known --first 0 --last 39 --out DIR
python tests/foreign/foreign_campaign.py --kind vo2 --style nanoribbon --first 400 --last 429 --out DIR

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

import foreign_grain_styles
import foreign_kept_cantilever_styles
import foreign_oscillator_styles
import foreign_response_styles
import foreign_styles

LONGEST_S = 3600.0  # of one command
NAMES_ALLOWED = 1  # in `indistinguishable_from`, for the true id among them to count
EFFECT_SETS = ("known", "new", "all")  # of oscillators: what the program had first, what came later, both
SAME = {"parameter.stiffness_cubic": "stiffness.cubic"}  # a term that the model lacks, and its value


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """A generator of cases, and where in a case's folder its files are."""

    styles: tuple[str, ...]  # in turn where none is asked for
    others: tuple[str, ...]  # only where asked for
    generator: str
    data: str  # folder with `dataset.toml`
    truth: str  # file that only the judge reads


KINDS = {
    "vo2": Kind(
        styles=foreign_styles.STYLES,
        others=(*foreign_grain_styles.STYLES, *foreign_kept_cantilever_styles.STYLES),
        generator="foreign_generate.py",
        data="",
        truth="truth.json",
    ),
    "oscillator": Kind(
        styles=foreign_oscillator_styles.STYLES,
        others=(*foreign_response_styles.STYLES, *foreign_oscillator_styles.KEPT),
        generator="foreign_oscillator_generate.py",
        data="data",
        truth="truth/truth.json",
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """What one case's diagnosis said, and the judgement: right | in sets | partly | wrong | missed | failed."""

    style: str
    seed: int
    effect: str | None
    second: str | None
    groups: list[str]
    share: float  # of the smaller effect
    outcome: str
    verdict: str | None
    causes: list[str]
    indistinguishable: list[str]
    probability: float | None
    identify_s: float
    diagnose_s: float
    note: str


def judge(effect: str | None, diagnosis: dict[str, Any], second: str | None = None) -> str:
    """Right, wrong (a cause that is not there) or missed (for a null: not `adequate`, but no cause either).

    One effect: its id is the first, or in a set of two. Two: both are named and no other; "in sets": each is, or stands
    in a set of two with the one that is; "partly": one of them alone is named.
    """
    causes = diagnosis["causes"]
    if effect is None:
        if diagnosis["verdict"] == "adequate" and not causes:
            return "right"
        return "wrong" if causes else "missed"
    if not causes:
        return "missed"
    if second is not None:
        told, hidden = {cause["id"] for cause in causes}, {effect, second}
        if told <= hidden:
            return "right" if told == hidden else "partly"
        sets = [_set_of(cause) for cause in causes]
        each = len(sets) == 2 and any(effect in a and second in b for a, b in (sets, sets[::-1]))
        return "in sets" if each else "wrong"
    if effect in _set_of(causes[0]):
        return "right"
    named = {cause["id"] for cause in causes}
    named.update(name for cause in causes for name in cause.get("indistinguishable_from", []))
    return "missed" if effect in named else "wrong"


def _set_of(cause: dict[str, Any]) -> set[str]:
    """The cause's id, with those that explain the data equally well if these are few."""
    others = cause.get("indistinguishable_from", [])
    return {cause["id"], *(others if len(others) <= NAMES_ALLOWED else [])}


def to_be_judged(
    diagnosis: dict[str, Any], also_true: list[str], hidden: tuple[str | None, ...] = ()
) -> dict[str, Any]:
    """The diagnosis without causes that are true of the bench beside any effect, and with one name for one thing.

    A cause that the data do not tell from a hidden effect stays: late readings are a late drive by construction.
    """
    causes = []
    for cause in diagnosis["causes"]:
        others = [SAME.get(name, name) for name in cause.get("indistinguishable_from", [])]
        if cause["id"] not in also_true or set(others) & set(hidden):
            name = SAME.get(cause["id"], cause["id"])
            causes.append({**cause, "id": name, "indistinguishable_from": others})
    only_these = bool(diagnosis["causes"]) and not causes
    verdict = "adequate" if only_these and diagnosis["verdict"] == "explained" else diagnosis["verdict"]
    return {**diagnosis, "verdict": verdict, "causes": causes}


def user_commands(folder: Path, data: Path) -> list[tuple[str, list[str]]]:
    """What a user runs, (verb, command): identify, or with `start.toml` identify from it, then diagnose.

    A user who has the model of a data sheet (`sheet.toml`) diagnoses that as it is.
    """
    rtctl = str(Path(sys.executable).with_name("rtctl"))
    manifest, start, sheet = data / "dataset.toml", data / "start.toml", data / "sheet.toml"
    model = sheet if sheet.exists() else folder / "model.toml"
    identify = [rtctl, "identify", str(manifest), "--out", str(model), "--quiet", "--no-plot"]
    if start.exists():
        identify += ["--model", str(start)]
    diagnose = [rtctl, "diagnose", str(manifest), "--model", str(model)]
    diagnose += ["--out", str(folder / "out"), "--quiet"]
    return ([] if sheet.exists() else [("identify", identify)]) + [("diagnose", diagnose)]


def run_case(style: str, seed: int, folder: Path, kind: str = "vo2", effects: str = "known") -> Case:
    """Write the case, identify and diagnose it in processes of their own."""
    spec, here = KINDS[kind], Path(__file__).resolve().parent
    write = [sys.executable, str(here / spec.generator), "--style", style, "--seed", str(seed)]
    write += ["--effect", "draw", "--out", str(folder)]
    write += ["--effects", effects] if kind == "oscillator" else []
    answer = folder / "out" / "diagnosis.json"
    answer.unlink(missing_ok=True)  # of a stopped campaign

    seconds, notes = {"identify": 0.0, "diagnose": 0.0}, []
    code, said = _run(write)
    if code != 0:
        notes.append(f"{spec.generator}: exit {code}: {said[-300:]}")
    for verb, command in user_commands(folder, folder / spec.data) if code == 0 else []:
        begin = time.perf_counter()
        ended, said = _run(command)
        seconds[verb] = round(time.perf_counter() - begin, 1)
        if ended != 0:
            notes.append(f"rtctl {verb}: exit {ended}: {said[-300:]}")
        if verb == "identify" and ended != 0 and not (folder / "model.toml").exists():
            break
    truth = json.loads((folder / spec.truth).read_text(encoding="utf-8")) if code == 0 else {}
    diagnosis = json.loads(answer.read_text(encoding="utf-8")) if answer.exists() else None
    judged: dict[str, Any] = {"causes": []}
    effect, second = truth.get("effect", "?"), truth.get("second")
    if diagnosis:
        judged = to_be_judged(diagnosis, truth.get("also_true", []), (effect, second))
    causes = judged["causes"]
    return Case(
        style=style,
        seed=seed,
        effect=effect,
        second=second,
        groups=truth.get("groups", []),
        share=truth.get("share", 0.0),
        outcome=judge(effect, judged, second) if diagnosis else "failed",
        verdict=diagnosis["verdict"] if diagnosis else None,
        causes=[cause["id"] for cause in diagnosis["causes"]] if diagnosis else [],
        indistinguishable=causes[0].get("indistinguishable_from", []) if causes else [],
        probability=causes[0].get("probability") if causes else None,
        identify_s=seconds["identify"],
        diagnose_s=seconds["diagnose"],
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
    """Markdown table of the counts: a row for each style, one for all, and one for each group of benches."""
    heads = ["style", "nulls", "called wrong", "not adequate", "singles", "right", "wrong name", "missed"]
    pairs_asked = any(case.get("second") for case in cases)
    if pairs_asked:
        heads += ["pairs", "both", "both, in sets", "one of two", "wrong name", "missed"]
    heads += ["failed", "median s"]
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    styles = [style for spec in KINDS.values() for style in (*spec.styles, *spec.others)]
    groups = sorted({group for case in cases for group in case["groups"]})
    for row in [*styles, "all", *groups]:
        mine = [case for case in cases if row in (case["style"], "all", *case["groups"])]
        if not mine:
            continue
        hidden = [(case.get("effect") is not None) + bool(case.get("second")) for case in mine]
        nulls, singles, pairs = (
            [case["outcome"] for case, count in zip(mine, hidden, strict=True) if count == wanted]
            for wanted in range(3)
        )
        cells = [row, str(len(nulls)), _share(nulls, "wrong"), _share(nulls, "missed"), str(len(singles))]
        cells += [_share(singles, outcome) for outcome in ("right", "wrong", "missed")]
        if pairs_asked:
            cells.append(str(len(pairs)))
            cells += [_share(pairs, outcome) for outcome in ("right", "in sets", "partly", "wrong", "missed")]
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
    parser = argparse.ArgumentParser(description="Identify and diagnose foreign cases; judge the answers.")
    parser.add_argument("--kind", choices=KINDS, default="vo2")
    parser.add_argument(
        "--effects", choices=EFFECT_SETS, default="known", help="of oscillators: drawn from these"
    )
    parser.add_argument("--first", type=int, required=True)
    parser.add_argument("--last", type=int, required=True)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--style", help="only this one; default: the kind's styles in turn")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    styles = KINDS[given.kind].styles
    known = (*styles, *KINDS[given.kind].others)
    if given.style not in (None, *known):
        parser.error(f"--style of --kind {given.kind} must be of {', '.join(known)}; got {given.style}")

    results = given.out / "results.jsonl"
    given.out.mkdir(parents=True, exist_ok=True)
    cases = read_results(results)
    results.write_text("".join(json.dumps(case) + "\n" for case in cases), encoding="utf-8")
    done = {(case["style"], case["seed"]) for case in cases}
    seeds = range(given.first, given.last + 1)
    wanted = [(given.style or styles[seed % len(styles)], seed) for seed in seeds]
    with ThreadPoolExecutor(given.workers) as pool:
        runs = [
            pool.submit(run_case, style, seed, given.out / f"{style}-{seed}", given.kind, given.effects)
            for style, seed in wanted
            if (style, seed) not in done
        ]
        for run in as_completed(runs):
            case = asdict(run.result())
            cases.append(case)
            with results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(case) + "\n")
            hidden = " + ".join(filter(None, (case["effect"], case["second"]))) or None
            told = case["causes"] or case["verdict"] or case["note"]
            print(f"{case['style']} {case['seed']}: {hidden}: {told}: {case['outcome']}", flush=True)
            (given.out / "table.md").write_text(table(cases), encoding="utf-8")
    (given.out / "table.md").write_text(table(cases), encoding="utf-8")
    print(table(cases))


if __name__ == "__main__":
    main()
