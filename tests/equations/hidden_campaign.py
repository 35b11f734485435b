"""Hidden effects in systems of equations: how often the diagnosis names them; rates by how well a system was known.

PYTHONPATH=. python tests/equations/hidden_campaign.py --seed 1 --systems motor,body --out out/equations
PYTHONPATH=. python tests/equations/hidden_campaign.py --seed 9000 --systems unseen --out out/unseen

Cases come in an order that the seed draws, and `cases.jsonl` grows by each: what a stopped run has done is a fair
sample, and the same command goes on. `--table FOLDER` prints the table of what is there.
"""

from __future__ import annotations

import argparse
import json
import traceback
from collections import Counter
from pathlib import Path

import numpy as np
from hidden.case import STOPPED, Judged, run_case
from hidden.effects import effects
from hidden.systems import DEVELOPED_ON, SYSTEMS
from hidden.unseen import UNSEEN


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--systems", default=",".join(SYSTEMS), help='names, or "unseen"')
    parser.add_argument("--effects", default="", help="ids, or parts of them; default: all and nothing")
    parser.add_argument("--nulls", type=int, default=3, help="devices with nothing hidden of each system")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument(
        "--table", action="store_true", help="print the table of the cases in --out, run none"
    )
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    file = args.out / "cases.jsonl"
    if args.table:
        print(_table([Judged(**json.loads(line)) for line in file.read_text(encoding="utf-8").splitlines()]))
        return
    wanted = [one for one in args.effects.split(",") if one]
    before = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
    done = [Judged(**json.loads(line)) for line in before]
    cases = [
        case
        for case in _drawn(args.seed, args.systems, args.nulls)
        if not wanted or any(one in (case[1] or "nothing") for one in wanted)
    ]
    with file.open("a", encoding="utf-8") as lines:
        for system, effect, seed in cases[len(done) :]:  # the order is that of the seed
            one = _run(args.out, system, effect, seed)
            done.append(one)
            lines.write(json.dumps(one._asdict()) + "\n")
            lines.flush()
            print(f"{one.system:9} {one.effect or 'nothing':30} {one.outcome:20} {one.verdict:17} {one.gain:6.1f} "
                  f"{one.seconds:5.1f} s  {one.named}", flush=True)  # fmt: skip
    print(_table(done))


def _drawn(seed: int, systems: str, nulls: int) -> list[tuple[str, str, int]]:
    """Return system, effect and seed of each case, in an order that `seed` draws."""
    chosen = tuple(UNSEEN) if systems == "unseen" else tuple(systems.split(","))
    cases = [
        (system, effect, seed + k)
        for system in chosen
        for k, effect in enumerate((*effects(SYSTEMS[system]), *[""] * nulls))
    ]
    return [cases[k] for k in np.random.default_rng(seed).permutation(len(cases))]


def _run(out: Path, system: str, effect: str, seed: int) -> Judged:
    try:
        return run_case(out / f"{system}-{effect or 'nothing'}-{seed}", system, effect, seed)
    except Exception:  # a case that fails is a finding, and the others go on
        if STOPPED in traceback.format_exc(limit=0):
            raise SystemExit(
                f"stopped in {system}, {effect or 'nothing'}; the same command goes on"
            ) from None
        return Judged(system, effect, "failed", traceback.format_exc(limit=-2), "failed", 0.0, 0.0)


def _table(done: list[Judged]) -> str:
    """One row a group of systems."""
    rows = ["| systems | effects | named, alone or in a set of two | in a larger set or beside others | missed | "
            "wrong | nothing hidden: right |", "|---|---|---|---|---|---|---|"]  # fmt: skip
    shipped = tuple(SYSTEMS.keys() - UNSEEN.keys() - set(DEVELOPED_ON))
    for title, own in (("developed on", DEVELOPED_ON), ("blind", shipped), ("never seen", tuple(UNSEEN))):
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
