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
STEP = "STEP = 1.0\n"
INNER = """
from step import STEP
from rtctl.border.kernels import kernel

@kernel
def inner(x: float) -> float:
    return x + STEP
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


def run(folder: Path) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(folder), str(Path(__file__).parents[2])])
    environment = {**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
    environment.pop("NUMBA_CACHE_DIR", None)
    command = [sys.executable, str(folder / "outer.py")]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True)


def run_outer(folder: Path) -> list[str]:
    return run(folder).stdout.split("\n")[:2]


def write_modules(folder: Path) -> None:
    for name, text in {"outer": OUTER, "inner": INNER, "pair": PAIR, "step": STEP}.items():
        (folder / f"{name}.py").write_text(text)


def test_a_damaged_cache_is_compiled_anew_and_renewed(tmp_path):
    write_modules(tmp_path)
    assert run_outer(tmp_path) == ["2.0 5.0", "0 0"]
    for index in (tmp_path / "__pycache__").glob("*.nbi"):
        index.write_bytes(index.read_bytes()[:50])
    assert run_outer(tmp_path) == ["2.0 5.0", "0 0"]
    for code in (tmp_path / "__pycache__").glob("*.nbc"):
        code.write_bytes(code.read_bytes()[:-9] + bytes(9))
    assert run_outer(tmp_path) == ["2.0 5.0", "0 0"]
    assert run_outer(tmp_path) == ["2.0 5.0", "1 1"]


def test_without_a_place_for_the_cache_everything_works_and_is_said(tmp_path):
    write_modules(tmp_path)
    (tmp_path / "sitecustomize.py").write_text(
        "import numba.core.caching as c\n"
        "c.CacheImpl._locator_classes = []\n"  # as where neither the package's folder nor the home can be written
    )
    done = run(tmp_path)
    assert done.stdout.split("\n")[:2] == ["2.0 5.0", "0 0"]
    assert done.stderr.count("set NUMBA_CACHE_DIR") == 1


def test_a_cached_kernel_is_compiled_anew_when_what_it_contains_changes(tmp_path):
    write_modules(tmp_path)
    assert run_outer(tmp_path) == ["2.0 5.0", "0 0"]
    assert run_outer(tmp_path) == ["2.0 5.0", "1 1"]
    (tmp_path / "step.py").write_text(STEP.replace("1.0", "3.0"))
    assert run_outer(tmp_path) == ["4.0 5.0", "0 0"], "a constant of another file"
    (tmp_path / "inner.py").write_text(INNER.replace("x + STEP", "x + 2.0"))
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


@kernel
def _times(x: float, k: int) -> float:
    return x * k


@kernel
def _five_times(x: float) -> float:
    return _times(x, 2) + _times(x, 3)


def test_a_kernel_is_compiled_once_for_all_numbers_that_stand_in_its_callers() -> None:
    assert _five_times(1.5) == 7.5
    compiled: Any = _times
    assert len(compiled.signatures) == 1
