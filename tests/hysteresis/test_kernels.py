"""Claims on the compiling decorator: arithmetic stays IEEE, a cache never outlives what it contains."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel, uncounted

PAIR = """
from typing import NamedTuple

class Pair(NamedTuple):
    first: float
    second: float
"""
INNER = """
from rtctl.border.kernels import kernel

@kernel
def inner(x: float) -> float:
    return x + 1.0
"""
OUTER = """
from inner import inner
from pair import Pair
from rtctl.border.kernels import kernel

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


def test_what_a_cache_depends_on_takes_the_same_room_however_many_kernels_contain_each_other():
    from rtctl.estimators.thermal_path import path_step

    compiled: Any = path_step
    assert len(compiled._cache._cache_file._source_stamp) == 64


@kernel
def doubled(values: FloatArray) -> float:
    """Twice the values, in place; the sum of what they were."""
    view, total = uncounted(values), 0.0
    for row in range(view.shape[0]):
        for column in range(view.shape[1]):
            total += view[row, column]
            view[row, column] *= 2.0
    return total


def test_a_view_without_a_count_of_references_is_the_array():
    values = np.arange(6.0).reshape(2, 3)
    assert doubled(values) == 15.0
    np.testing.assert_array_equal(values, 2.0 * np.arange(6.0).reshape(2, 3))


def test_uncompiled_it_is_the_array_itself():
    script = "import numpy, rtctl.border.kernels as k; a = numpy.zeros(2); print(k.uncounted(a) is a)"
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout == "True\n"
