"""What a command costs the first time on a machine, when its kernels are compiled, and every time after.

python benchmarks/first_use.py diagnose data/dataset.toml --model model.toml --out answer

Runs `rtctl` with these arguments twice in processes of their own: with an empty folder of compiled kernels, then with
the one that the first run has filled. Compilation is told in processor time of that process, so that other work on the
machine matters less.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

HEAD = "| run | elapsed [s] | processor time [s] | of it compiling [s] | functions compiled |\n|---|---|---|---|---|"
CHILD = """
import sys, time
import numba.core.dispatcher as dispatcher
from rtctl.cli import main

depth, spent, count = 0, 0.0, 0
compile_one = dispatcher._FunctionCompiler.compile


def timed(self, *arguments):
    global depth, spent, count
    depth, count, begun = depth + 1, count + 1, time.process_time()
    try:
        return compile_one(self, *arguments)
    finally:
        depth -= 1
        spent += time.process_time() - begun if depth == 0 else 0.0


dispatcher._FunctionCompiler.compile = timed
code = main(sys.argv[1:])
print(f"FIRST-USE {time.process_time():.3f} {spent:.3f} {count}")
sys.exit(code)
"""


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
                [sys.executable, "-c", CHILD, *arguments],
                env=environment,
                capture_output=True,
                text=True,
                check=False,
            )
            elapsed_s = time.perf_counter() - begun
            last = done.stdout.strip().rpartition("FIRST-USE ")[2].split()
            if done.returncode != 0 or len(last) != 3:
                print(done.stdout + done.stderr, file=sys.stderr)
                return 1
            print(f"| {name} | {elapsed_s:.1f} | {float(last[0]):.1f} | {float(last[1]):.1f} | {last[2]} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
