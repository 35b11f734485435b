"""The blind campaign: seeds A-B on all cores, resumable; its tables as Markdown.

python tests/blind/campaign.py --seeds 0-399 --out out/blind
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from case import dump, run_case

Line = dict[str, Any]
MISS_EDGES = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, np.inf)
PROBABILITIES = (0.0, 0.5, 0.9, 0.99, 1.01)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what is missing, then write the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="0-399", help="first-last, both included")
    parser.add_argument(
        "--out", type=Path, default=Path("out/blind"), help="folder of cases.jsonl and blind.md"
    )
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    asked = parser.parse_args(arguments)
    first, last = (int(part) for part in asked.seeds.split("-"))
    asked.out.mkdir(parents=True, exist_ok=True)
    path = asked.out / "cases.jsonl"
    done = {line["seed"]: line for line in _read(path)}
    missing = [seed for seed in range(first, last + 1) if seed not in done]
    with path.open("a", encoding="utf-8") as file:
        for count, line in enumerate(_run(missing, asked.workers), 1):
            file.write(dump(line) + "\n")
            file.flush()
            done[line["seed"]] = line
            print(
                f"\r{count}/{len(missing)}  seed {line['seed']} {line['judgement']:8}",
                end="",
                file=sys.stderr,
            )
    lines = [done[seed] for seed in range(first, last + 1) if seed in done]
    table = tables(lines, f"python tests/blind/campaign.py --seeds {asked.seeds}")
    (asked.out / "blind.md").write_text(table, encoding="utf-8")
    print(f"\n{table}")
    return 0


def _read(path: Path) -> list[Line]:
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def _run(seeds: Sequence[int], workers: int) -> Iterator[Line]:
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ[name] = "1"  # two workers, one core each
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        for future in as_completed([pool.submit(run_case, seed) for seed in seeds]):
            yield future.result()


def tables(lines: Sequence[Line], command: str) -> str:
    """All tables as Markdown."""
    parts = [f"{len(lines)} cases: `{command}`", _figures(lines), _confusion(lines), _by_size(lines),
             _calibration(lines)]  # fmt: skip
    return "\n\n".join(parts) + "\n"


def _figures(lines: Sequence[Line]) -> str:
    kinds = {kind: [x for x in lines if x["kind"] == kind] for kind in ("null", "single", "pair", "outside")}
    singles, times = kinds["single"], [x["cpu_s"] for x in lines]
    alone = [
        x for x in singles if x["judgement"] == "false" and len(x["causes"]) == 1 and not x["causes"][0]["or"]
    ]
    errors = [x["test_error_over_noise"] for x in singles + kinds["pair"]
              if x.get("test_error_over_noise") and x["verdict"] == "explained"]  # fmt: skip
    seen = [x for x in lines if x["kind"] != "null" and x["miss_over_noise"] >= 0.1]
    rows = [
        ("nothing hidden: something claimed", "at most 5 %", _share(kinds["null"], {"false", "crash"})),
        ("one effect: named, alone or in a set of two", "at least 95 %", _share(singles, {"right", "set"})),
        ("one effect: a single wrong name alone", "at most 1 %", _of(len(alone), len(singles))),
        ("two effects: both and only both", "at least 85 %", _share(kinds["pair"], {"right", "set"})),
        ("outside the catalogue: nothing false", "at least 90 %", _share(kinds["outside"], {"right"})),
        ("detected where the nominal model misses by 0.1 of the noise or more", "at least 95 %",
         _of(sum(x["verdict"] not in ("adequate", "crash") for x in seen), len(seen))),
        ("test error after extension over the noise, median", "at most 1.1",
         f"{np.median(errors):.3f}" if errors else "-"),
        ("processor time a case, median and worst", "30 s, 90 s",
         f"{np.median(times):.1f} s, {max(times):.1f} s" if times else "-"),
    ]  # fmt: skip
    return _markdown(("", "reach", "measured"), rows)


def _confusion(lines: Sequence[Line]) -> str:
    counts: Counter[tuple[str, str]] = Counter()
    for line in lines:
        named = " + ".join(sorted(one["id"] for one in line["causes"])) or line["verdict"]
        counts[" + ".join(sorted(line["truth"])) or "nothing", named] += 1
    rows = [(truth, named, str(count)) for (truth, named), count in sorted(counts.items())]
    return _markdown(("truth", "answer", "cases"), rows)


def _by_size(lines: Sequence[Line]) -> str:
    rows = []
    for low, high in zip(MISS_EDGES[:-1], MISS_EDGES[1:], strict=True):
        chosen = [x for x in lines if x["kind"] in ("single", "pair") and low <= x["miss_over_noise"] < high]
        cells = (
            _share(chosen, {judgement}) for judgement in ("right", "set", "missed", "part", "wide", "false")
        )
        rows.append((f"{low:g} to {high:g}", str(len(chosen)), *cells))
    head = ("miss over noise", "cases", "right", "set of two", "missed", "part", "wide", "false")
    return _markdown(head, rows)


def _calibration(lines: Sequence[Line]) -> str:
    claims = [
        (one["probability"], one["id"] in x["truth"] or one["id"] in x["equivalent"])
        for x in lines for one in x["causes"]
    ]  # fmt: skip
    rows = []
    for low, high in zip(PROBABILITIES[:-1], PROBABILITIES[1:], strict=True):
        chosen = [right for probability, right in claims if low <= probability < high]
        rows.append((f"{low:g} to {min(high, 1.0):g}", str(len(chosen)), _of(sum(chosen), len(chosen))))
    return _markdown(("probability stated", "claims", "true"), rows)


def _share(lines: Sequence[Line], judgements: set[str]) -> str:
    return _of(sum(line["judgement"] in judgements for line in lines), len(lines))


def _of(count: int, total: int) -> str:
    return f"{100.0 * count / total:.1f} % ({count} of {total})" if total else "-"


def _markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


if __name__ == "__main__":
    raise SystemExit(main())
