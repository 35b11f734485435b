"""Processor time goes to the function that spent it, that of compiled code to its caller; labels are by depth."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))

from first_use import part_of  # noqa: E402
from stack_sampler import Place, StackSampler, deepest  # noqa: E402


def in_python(seconds: float) -> None:
    """Spend processor time in the interpreter."""
    end = time.process_time() + seconds
    while time.process_time() < end:
        pass


def in_a_kernel(seconds: float) -> None:
    """Spend it in calls of 50 ms that no signal interrupts."""
    matrix = np.random.default_rng(0).standard_normal((700, 700))
    end = time.process_time() + seconds
    while time.process_time() < end:
        np.linalg.svd(matrix[:, :150], full_matrices=False)


def test_time_is_put_down_to_who_spent_it() -> None:
    label = deepest(
        {"in_python": "python", "in_a_kernel": "kernel", "test_time_is_put_down_to_who_spent_it": "test"}, ""
    )
    begun = time.process_time()
    with StackSampler(by=label) as sampler:
        in_python(0.15)
        in_a_kernel(0.3)
    seconds, total = sampler.seconds["by"], time.process_time() - begun
    assert abs(seconds.total() - total) < 0.2 * total
    assert 0.5 < seconds["kernel"] / seconds["python"] / 2.0 < 2.0
    assert seconds["test"] < 0.2 * total


def test_the_innermost_known_function_gives_the_label() -> None:
    label = deepest({"verify": "verification", "find_better_alternative": "laws without a formula"}, "other")
    inner = (Place("a.py", "verify"), Place("b.py", "find_better_alternative"), Place("c.py", "minimise"))
    assert label(inner) == "laws without a formula"
    assert label(inner[:1]) == "verification"
    assert label(inner[2:]) == "other"


def test_a_moment_of_a_first_use_belongs_to_one_part() -> None:
    main, numba = Place("cli/__init__.py", "main"), Place("site-packages/numba/core/dispatcher.py", "compile")
    bootstrap = Place("<frozen importlib._bootstrap>", "_find_and_load")
    assert part_of((main, bootstrap, numba)) == "import"
    assert part_of((main, Place("a.py", "read_dataset"), numba)) == "compile"
    assert part_of((main, numba, Place("numba/core/caching.py", "load_overload"))) == "load"
    assert part_of((main, Place("a.py", "read_dataset"), Place("b.py", "parse"))) == "read"
    assert part_of((main, Place("files.py", "write_diagnosis"), Place("read.py", "read_dataset"))) == "draw"
    assert part_of((main, Place("search.py", "find_causes"))) == "work"
