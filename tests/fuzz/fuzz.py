"""Random inputs for every reader, TOML file and codec: `python tests/fuzz/fuzz.py --seed 1 --count 10000 [TARGET ...]`.

Prints one line a target and every finding. `--case K` runs one case in this process, with its traceback.
Exit 1: something was found.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import tempfile
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "measured"))  # writers of foreign files

from fuzz_run import Outcome, run
from fuzz_targets import Target, targets

KINDS = ("crash", "hang", "traceback", "files")


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("targets", nargs="*", metavar="TARGET", help="default: all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=1000, help="inputs of each target")
    parser.add_argument("--first", type=int, default=0, help="first case")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="at most so long for each target")
    parser.add_argument("--case", type=int, help="this case alone, in this process")
    parser.add_argument("--out", type=Path, help="findings as JSON, one a line")
    args = parser.parse_args()
    known = targets()
    unknown = [name for name in args.targets if name not in known]
    if unknown:
        parser.error(f"no target {', '.join(unknown)}; known: {', '.join(known)}")
    chosen = {name: known[name] for name in args.targets or known}
    if args.case is not None:
        return _one_case(chosen, args.seed, args.case)
    outcomes = []
    print(
        f"{'target':<24} {'inputs':>8} {'refused':>8} " + " ".join(f"{kind:>9}" for kind in KINDS), flush=True
    )
    for name, target in chosen.items():
        cases = range(args.first, args.first + args.count)
        outcomes.append(run(name, target, args.seed, cases, args.seconds))
        print(_line(outcomes[-1]), flush=True)
        if args.out is not None:
            with args.out.open("a") as file:
                file.writelines(json.dumps({"target": name, **one}) + "\n" for one in outcomes[-1].found)
    for one in outcomes:
        for found in {str(found["text"])[-200:]: found for found in reversed(one.found)}.values():
            print(
                f"\n{one.target} --seed {args.seed} --case {found['case']}: {found['kind']}\n{found['text']}"
            )
    total = sum(one.inputs for one in outcomes)
    print(f"\n{total} inputs, {sum(len(one.found) for one in outcomes)} findings")
    return int(any(one.found for one in outcomes))


def _line(one: Outcome) -> str:
    counts = one.counts()
    return f"{one.target:<24} {one.inputs:>8} {one.refused:>8} " + " ".join(
        f"{counts[kind]:>9}" for kind in KINDS
    )


def _one_case(chosen: dict[str, Target], seed: int, case: int) -> int:
    for name, target in chosen.items():
        target.prepare()
        with tempfile.TemporaryDirectory() as folder:
            try:
                target.case(random.Random(f"{seed}/{name}/{case}"), Path(folder))
            except target.messages as error:
                print(f"{name}: {error}")
            else:
                print(f"{name}: read")
    return 0


if __name__ == "__main__":
    sys.exit(main())
