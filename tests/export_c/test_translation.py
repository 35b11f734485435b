"""The translated language: what it refuses, and what its C keeps of Python."""

from __future__ import annotations

import math
import subprocess
from pathlib import Path
from typing import Any

import pytest

from rtctl.translation.c99.arithmetic import ARITHMETIC
from rtctl.translation.c99.statements import Function
from rtctl.translation.inference import Program
from rtctl.translation.source import NotTranslatableError
from rtctl.translation.types import INT, REAL, ArrayType


def library_function(x: float) -> float:
    """Use a function whose last bits depend on the C library."""
    return math.exp(x)


def dictionary(x: float) -> float:
    """Use what C does not have."""
    return {"x": x}["x"]


def rounding(a: int, b: int, x: float) -> float:
    """Divide integers that are negative, keep the association of sums, chain comparisons."""
    y = x - (a // b - (a % b))
    return y if 0.0 < y < 10.0 and not y > 9.0 else -y


def swapped(a: float, b: float) -> float:
    """Assign two names at once, each to the other."""
    a_now, b_now = a, b
    a_now, b_now = b_now, a_now
    return a_now - 2.0 * b_now


def last_of_a_copy(w: Any, x: float) -> float:
    """Change a copy and leave the array."""
    trial = w.copy()
    trial[-1] = x
    part = trial[1:]
    return part[part.size - 1] + w[-1]


def compiled(tmp_path: Path, function: Any, types: list[Any], call: str) -> float:
    """Return what the C of a function gives for a call."""
    program = Program()
    program.add(function, types, [4 if isinstance(one, ArrayType) else 0 for one in types])
    text = "\n".join(line for one in program.instances for line in Function(one).lines())
    main = f'#include <stdio.h>\nint main(void) {{ printf("%.17g", (double){call}); return 0; }}'
    (tmp_path / "t.c").write_text(f'#include "rtctl_arithmetic.h"\n{text}\n{main}\n')
    command = [
        "gcc",
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-DRTCTL_DOUBLE",
        f"-I{ARITHMETIC.parent}",
        "t.c",
        "-o",
        "t",
    ]
    subprocess.run(command, cwd=tmp_path, check=True)
    return float(subprocess.run(["./t"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout)


@pytest.mark.parametrize("function", [library_function, dictionary])
def test_a_refusal_names_module_line_and_function(function: Any) -> None:
    with pytest.raises(NotTranslatableError) as refused:
        Program().add(function, [REAL], [0])
    line = function.__code__.co_firstlineno + 2
    assert f"test_translation, line {line}, {function.__name__}" in str(refused.value)


@pytest.mark.parametrize(("a", "b"), [(7, 2), (-7, 2), (-8, 3)])
def test_integers_divide_as_in_python(tmp_path: Path, a: int, b: int) -> None:
    assert compiled(tmp_path, rounding, [INT, INT, REAL], f"rounding({a}, {b}, 2.5)") == rounding(a, b, 2.5)


def test_names_are_assigned_at_once(tmp_path: Path) -> None:
    assert compiled(tmp_path, swapped, [REAL, REAL], "swapped(3.0, 5.0)") == swapped(3.0, 5.0)


def test_a_copy_is_a_copy(tmp_path: Path) -> None:
    array = "(real_list){(const real_t[]){1.0, 2.0, 3.0, 4.0}, 4}"
    assert compiled(tmp_path, last_of_a_copy, [ArrayType(), REAL], f"last_of_a_copy({array}, 9.0)") == 13.0
