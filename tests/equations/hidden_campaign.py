"""Hidden effects in four systems of equations: how often the diagnosis names them; rates of the systems apart.

PYTHONPATH=. python tests/equations/hidden_campaign.py --seed 1 --systems motor,body --out out/equations
"""

from __future__ import annotations

import argparse
import json
import traceback
from collections import Counter
from pathlib import Path

from hidden.case import Judged, run_case
from hidden.effects import effects
from hidden.systems import DEVELOPED_ON, SYSTEMS


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--systems", default=",".join(SYSTEMS))
    parser.add_argument("--effects", default="", help="ids, or parts of them; default: all and nothing")
    parser.add_argument("--nulls", type=int, default=3, help="devices with nothing hidden of each system")
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    done: list[Judged] = []
    for system in args.systems.split(","):
        wanted = [one for one in args.effects.split(",") if one]
        cases = [(effect, args.seed + k) for k, effect in enumerate(effects(SYSTEMS[system]))]
        cases += [("", args.seed + 1000 + k) for k in range(args.nulls)]
        for effect, seed in cases:
            if wanted and not any(one in (effect or "nothing") for one in wanted):
                continue
            done.append(_run(args.out, system, effect, seed))
            one = done[-1]
            print(f"{one.system:8} {one.effect or 'nothing':30} {one.outcome:20} {one.verdict:17} {one.gain:6.1f} "
                  f"{one.seconds:5.1f} s  {one.named}", flush=True)  # fmt: skip
    lines = [json.dumps(one._asdict()) for one in done]
    (args.out / "cases.jsonl").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(_table(done))


def _run(out: Path, system: str, effect: str, seed: int) -> Judged:
    try:
        return run_case(out / f"{system}-{effect or 'nothing'}-{seed}", system, effect, seed)
    except Exception:  # a case that fails is a finding, and the others go on
        return Judged(system, effect, "failed", traceback.format_exc(limit=-2), "failed", 0.0, 0.0)


def _table(done: list[Judged]) -> str:
    """One row a group of systems."""
    rows = ["| systems | effects | named, alone or in a set of two | in a larger set or beside others | missed | "
            "wrong | nothing hidden: right |", "|---|---|---|---|---|---|---|"]  # fmt: skip
    for title, own in (("developed on", DEVELOPED_ON), ("blind", tuple(SYSTEMS.keys() - set(DEVELOPED_ON)))):
        count = Counter(one.outcome for one in done if one.system in own and one.effect)
        nulls = Counter(one.outcome for one in done if one.system in own and not one.effect)
        named = count["right"] + count["right of two"]
        larger = sum(number for name, number in count.items() if name.startswith("right")) - named
        wrong = count["wrong"] + count["failed"]
        rows.append(f"| {title}: {', '.join(sorted(own))} | {count.total()} | {named} | {larger} | {count['missed']} | "
                    f"{wrong} | {nulls['right']} of {nulls.total()} |")  # fmt: skip
    return "\n".join(rows)


if __name__ == "__main__":
    main()
