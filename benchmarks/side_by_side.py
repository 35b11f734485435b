"""rtctl beside what a user would pick instead, in one run: time and accuracy, on our home ground and on theirs.

    python benchmarks/side_by_side.py [--tasks NAME ...] [--silverbox FOLDER] [--rounds 3]

SciPy's solvers always; pysindy, SysIdentPy, pynamicalsys and freq-statespace where they are installed (pip install
pysindy sysidentpy pynamicalsys freq-statespace); those that are not are told. Processor seconds: the first call, which
compiles or imports, and the median of `rounds` further ones, tools by turns. Each tool is used as its own
documentation does, with the settings that the row says.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from statistics import median

from rivals.identifying import lorenz, silverbox
from rivals.simulating import ensemble, sampled_drive, smooth, stiff
from rivals.tool import Tool
from threadpoolctl import threadpool_limits

ROOT = Path(__file__).resolve().parents[1]
HEAD = "| task | tool and settings | first [s] | then [s] | accuracy |\n|---|---|---|---|---|"
TASKS: dict[str, tuple[str, Callable[[Path], Iterator[Tool]]]] = {
    "sampled-drive": ("simulate a sampled drive, 2,000 samples", sampled_drive),
    "smooth": ("a smooth orbit, 100 s", smooth),
    "stiff": ("a stiff one: van der Pol, mu = 100, 300 s", stiff),
    "stiffer": ("the same with mu = 1000, 3,000 s", partial(stiff, mu=1000.0)),
    "ensemble": ("100 starts, 200 periods of drive", ensemble),
    "silverbox": ("identify the Silverbox", silverbox),
    "lorenz": ("equations of Lorenz's system from its states", lorenz),
}


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tasks", nargs="+", choices=TASKS, default=list(TASKS))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--silverbox", type=Path, default=ROOT.parent / "shared" / "data" / "silverbox")
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    print(HEAD)
    with threadpool_limits(1, "blas"), tempfile.TemporaryDirectory() as folder:
        for name in asked.tasks:
            title, tools_of = TASKS[name]
            compare(title, tools_of(asked.silverbox if name == "silverbox" else Path(folder)), asked.rounds)


def compare(title: str, tools: Iterable[Tool], rounds: int) -> None:
    """Time the tools by turns and print their rows."""
    ready, first, spent, found = list(tools), {}, {}, {}
    for turn in range(rounds + 1):
        for tool in ready:
            if turn and (tool.once or tool.name not in spent):
                continue
            begun = time.process_time()
            with contextlib.redirect_stdout(io.StringIO()):
                try:
                    result = tool.run()
                except ImportError as error:
                    found[tool.name] = f"not installed ({error.name})"
                    continue
            seconds = time.process_time() - begun
            if not turn:
                first[tool.name], spent[tool.name] = seconds, []
                found[tool.name] = tool.judge(result)
            else:
                spent[tool.name].append(seconds)
    for tool in ready:
        costs = [f"{first[tool.name]:.3g}" if tool.name in first else "", ""]
        if spent.get(tool.name):
            costs[1] = f"{median(spent[tool.name]):.3g}"
        print(f"| {title} | {tool.name} | {' | '.join(costs)} | {found[tool.name]} |", flush=True)


if __name__ == "__main__":
    main()
