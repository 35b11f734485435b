"""Asks `rtctl identify` and `rtctl diagnose` about plants that are no single oscillator; counts names that are wrong.

python tests/foreign/other_plants_campaign.py --first 0 --last 4 --out DIR [--plants two_tanks,motor_speed]

DIR/results.jsonl gets one line a case (a stopped campaign continues); the table is printed at the end.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

from foreign_other_plants import PLANTS, TRUE, generate

OUTCOMES = ("refused", "no name", "true", "some true", "wrong")
TOLD = ("is this an oscillator", "no oscillator", "two frequencies", "no single oscillator")


def run_case(name: str, seed: int, folder: Path) -> dict[str, Any]:
    """Identify and diagnose a case as a user would; returns its line."""
    manifest, model, answer = generate(name, seed, folder / "data"), folder / "model.toml", folder / "answer"
    line: dict[str, Any] = {"plant": name, "seed": seed}
    begin = time.monotonic()
    found = _rtctl("identify", str(manifest), "--out", str(model), "--no-plot")
    line["identify_code"] = found.returncode
    if not model.exists():
        return line | {"verdict": "refused", "causes": [], "said": found.stderr[-500:]}
    found = _rtctl("diagnose", str(manifest), "--model", str(model), "--out", str(answer))
    line["seconds"] = round(time.monotonic() - begin, 1)
    if not (answer / "diagnosis.json").exists():
        return line | {"verdict": "refused", "causes": [], "said": found.stderr[-500:]}
    told = json.loads((answer / "diagnosis.json").read_text(encoding="utf-8"))
    gain = told.get("gain") or {}
    return line | {
        "verdict": told["verdict"],
        "causes": [(one["id"], one["indistinguishable_from"]) for one in told["causes"]],
        "gain": gain.get("ratio"),
        "said": [one for one in told["warnings"] if any(part in one for part in TOLD)],
    }


def _rtctl(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "rtctl", *arguments, "--quiet"]
    return subprocess.run(command, capture_output=True, text=True, timeout=3600.0, check=False)


def judge(line: dict[str, Any]) -> str:
    """Return which of OUTCOMES a line is: a name is true if it, or one of its set, is a law of the plant."""
    true = TRUE.get(line["plant"], set())
    causes = [{one, *others} for one, others in line["causes"]]
    right = [bool(names & true) or all(name.startswith("parameter.") for name in names) for names in causes]
    if not causes:
        return "refused" if line["verdict"] == "refused" else "no name"
    return "true" if all(right) else "some true" if any(right) else "wrong"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plants", default=",".join(PLANTS))
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--last", type=int, default=2)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    file = asked.out / "results.jsonl"
    lines = [json.loads(one) for one in file.read_text().splitlines()] if file.exists() else []
    done = {(one["plant"], one["seed"]) for one in lines}
    for seed in range(asked.first, asked.last + 1):
        for name in asked.plants.split(","):
            if (name, seed) in done:
                continue
            line = run_case(name, seed, asked.out / f"{name}-{seed}")
            lines.append(line)
            with file.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(line) + "\n")
            print(f"{name} {seed}: {judge(line)}, {line['verdict']}, {line['causes']}", flush=True)
    print(table(lines))


def table(lines: list[dict[str, Any]]) -> str:
    """Return the outcomes by plant, and how often the answer doubts that this is an oscillator."""
    columns = ("plant", "cases", *OUTCOMES, "kind of plant doubted")
    rows = ["| " + " | ".join(columns) + " |", "|---" * len(columns) + "|"]
    for name in [*PLANTS, "all"]:
        own = [one for one in lines if name in (one["plant"], "all")]
        counts, told = Counter(judge(one) for one in own), sum(bool(one["said"]) for one in own)
        numbers = " | ".join(str(counts[one]) for one in OUTCOMES)
        rows.append(f"| {name} | {len(own)} | {numbers} | {told} |")
    return "\n".join(rows)


if __name__ == "__main__":
    main()
