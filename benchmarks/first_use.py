"""What a command costs the first time on a machine, when its kernels are compiled, and every time after.

python benchmarks/first_use.py diagnose data/dataset.toml --model model.toml --out answer

Runs `rtctl` with these arguments twice in processes of their own: with an empty folder of compiled kernels, then with
the one that the first run has filled. Times are processor times of that process, so that other work on the machine
matters less; what is neither importing, compiling, reading nor drawing is the work itself.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from stack_sampler import Stack, is_compiling, is_importing

HERE = Path(__file__).resolve().parent
COLUMNS = (
    "run", "elapsed [s]", "processor time [s]", "importing", "compiling", "loading kernels", "reading",
    "drawing, writing", "functions compiled",
)  # fmt: skip
HEAD = f"| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}"
PARTS = ("import", "compile", "load", "read", "draw")
READING = ("read_dataset", "open_dataset", "dataset_of", "stored_dataset_of", "model_of")
DRAWING = ("write_diagnosis", "save", "print_diagnosis", "print_fit")
CHILD = """
import sys, time
sys.path.insert(0, sys.argv.pop(1))
from first_use import part_of
from stack_sampler import StackSampler
sampler = StackSampler(part=part_of).__enter__()
import numba.core.dispatcher as dispatcher
from rtctl.cli import main

count = 0
compile_one = dispatcher._FunctionCompiler.compile


def timed(self, *arguments):
    global count
    count += 1
    return compile_one(self, *arguments)


dispatcher._FunctionCompiler.compile = timed
code = main(sys.argv[1:])
sampler.__exit__()
seconds = sampler.seconds["part"]
parts = [f"{seconds[name]:.3f}" for name in ("import", "compile", "load", "read", "draw")]
print("FIRST-USE", f"{time.process_time():.3f}", *parts, count)
sys.exit(code)
"""


def part_of(stack: Stack) -> str:
    """What a moment belongs to: one of `PARTS`, or the work itself."""
    functions = {one.function for one in stack}
    if is_importing(stack):
        return "import"
    if is_compiling(stack):
        return "load" if "load_overload" in functions else "compile"
    if functions.intersection(DRAWING):
        return "draw"
    return "read" if functions.intersection(READING) else "work"


def main() -> int:
    """Print a table of both runs."""
    arguments = sys.argv[1:]
    if not arguments:
        print(__doc__)
        return 2
    print(HEAD)
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
        for name in ("first", "second"):
            begun = time.perf_counter()
            done = subprocess.run(
                [sys.executable, "-c", CHILD, str(HERE), *arguments],
                env=environment,
                capture_output=True,
                text=True,
                check=False,
            )
            elapsed_s = time.perf_counter() - begun
            last = done.stdout.strip().rpartition("FIRST-USE ")[2].split()
            if done.returncode != 0 or len(last) != len(PARTS) + 2:
                print(done.stdout + done.stderr, file=sys.stderr)
                return 1
            seconds = " | ".join(f"{float(one):.2f}" for one in last[:-1])
            print(f"| {name} | {elapsed_s:.1f} | {seconds} | {last[-1]} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
