"""Claims on the compiling decorator: arithmetic stays IEEE, a cache never outlives what it contains."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path

from rtctl.kernels import kernel

INNER = """
from rtctl.kernels import kernel

@kernel
def inner(x: float) -> float:
    return x + {offset}
"""
OUTER = """
from inner import inner
from rtctl.kernels import kernel

@kernel
def outer(x: float) -> float:
    return inner(x)

if __name__ == "__main__":
    import outer as cached  # a module with a name, as numba's cache wants it
    print(cached.outer(1.0), sum(cached.outer.stats.cache_hits.values()))
"""


def run_outer(folder: Path) -> list[str]:
    path = os.pathsep.join([str(folder), str(Path(__file__).parents[2])])
    environment = {**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
    environment.pop("NUMBA_CACHE_DIR", None)
    command = [sys.executable, str(folder / "outer.py")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.split()


def test_a_cached_kernel_is_compiled_anew_when_a_kernel_it_calls_changes(tmp_path):
    (tmp_path / "outer.py").write_text(OUTER)
    (tmp_path / "inner.py").write_text(INNER.format(offset="1.0"))
    assert run_outer(tmp_path) == ["2.0", "0"]
    assert run_outer(tmp_path) == ["2.0", "1"]
    (tmp_path / "inner.py").write_text(INNER.format(offset="2.0"))
    assert run_outer(tmp_path) == ["3.0", "0"]


@kernel
def divide(a: float, b: float) -> float:
    """a / b."""
    return a / b


def test_a_kernel_divides_by_zero_as_ieee_says_and_keeps_its_name():
    assert divide(1.0, 0.0) == math.inf
    assert math.isnan(divide(0.0, 0.0))
    assert divide.__name__ == "divide"
    assert divide.__doc__ == "a / b."
