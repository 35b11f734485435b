"""Claims on the compiling decorator: arithmetic stays IEEE, a cache never outlives what it contains."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path

from rtctl.kernels import kernel

PAIR = """
from typing import NamedTuple

class Pair(NamedTuple):
    first: float
    second: float
"""
INNER = """
from rtctl.kernels import kernel

@kernel
def inner(x: float) -> float:
    return x + 1.0
"""
OUTER = """
from inner import inner
from pair import Pair
from rtctl.kernels import kernel

@kernel
def outer(x: float) -> float:
    return through(x)

@kernel
def through(x: float) -> float:
    return inner(x)

@kernel
def first_of(pair: Pair) -> float:
    return pair.first

if __name__ == "__main__":
    import outer as cached  # a module with a name, as numba's cache wants it
    kernels = cached.outer, cached.first_of
    print(cached.outer(1.0), cached.first_of(Pair(5.0, 6.0)))
    print(*(sum(each.stats.cache_hits.values()) for each in kernels))
"""


def run_outer(folder: Path) -> list[str]:
    path = os.pathsep.join([str(folder), str(Path(__file__).parents[2])])
    environment = {**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
    environment.pop("NUMBA_CACHE_DIR", None)
    command = [sys.executable, str(folder / "outer.py")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.split("\n")[:2]


def test_a_cached_kernel_is_compiled_anew_when_what_it_contains_changes(tmp_path):
    (tmp_path / "outer.py").write_text(OUTER)
    (tmp_path / "inner.py").write_text(INNER)
    (tmp_path / "pair.py").write_text(PAIR)
    assert run_outer(tmp_path) == ["2.0 5.0", "0 0"]
    assert run_outer(tmp_path) == ["2.0 5.0", "1 1"]
    (tmp_path / "inner.py").write_text(INNER.replace("x + 1.0", "x + 2.0"))
    assert run_outer(tmp_path) == ["3.0 5.0", "0 0"]
    swapped = PAIR.replace("first: float\n    second: float", "second: float\n    first: float")
    (tmp_path / "pair.py").write_text(swapped)
    assert run_outer(tmp_path) == ["3.0 6.0", "0 0"]


@kernel
def divide(a: float, b: float) -> float:
    """a / b."""
    return a / b


def test_a_kernel_divides_by_zero_as_ieee_says_and_keeps_its_name():
    assert divide(1.0, 0.0) == math.inf
    assert math.isnan(divide(0.0, 0.0))
    assert divide.__name__ == "divide"
    assert divide.__doc__ == "a / b."
