"""The laws of a user's equations as an estimator computes them: compiled, by elementary functions of its own.

The simulated device compiles the same equations by another writer, with the C library's functions. Here each operation
is that of exported C, so that both give the same bits.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from rtctl.arithmetic import elementary
from rtctl.border.arrays import FloatArray
from rtctl.border.equations.controlled import StateSpace
from rtctl.border.kernels import first_class
from rtctl.border.machine_code import cache as kernel_cache
from rtctl.border.machine_code.generated import compiled, made

FUNCTIONS: dict[str, Callable[..., float]] = {
    name: getattr(elementary, name)
    for name in (
        "acos", "asin", "atan", "atan2", "cos", "cosh", "exp", "fabs", "floor", "log", "power", "sin", "sinh", "sqrt",
        "tan", "tanh",
    )
}  # fmt: skip
"""What the sources of laws call."""


class Laws(NamedTuple):
    """Compiled laws, each `law(x, u, p, out) -> 0`; see `rtctl.border.equations.controlled.LawSources`."""

    rates: Any
    outputs: Any
    guards: Any
    """None where there are no events, as `resets`."""
    resets: Any
    directions: FloatArray
    """Direction (events,) in which each passes zero."""


def laws_of(model: StateSpace) -> Laws:
    """Return the compiled laws of a model."""
    own = tuple(model.sources.own.items())
    names = ("rates", "outputs", "guards", "resets") if len(model.directions) else ("rates", "outputs")
    laws = {name: _law(getattr(model.sources, name), name, own) for name in names}
    return Laws(laws["rates"], laws["outputs"], laws.get("guards"), laws.get("resets"), model.directions)


def law_function(model: StateSpace, name: str) -> Callable[..., int]:
    """Return a law of a model as plain Python, whose source can be read."""
    names = {**FUNCTIONS, **model.sources.own}
    function: Callable[..., int] = made(getattr(model.sources, name), name, names, __name__, readable=True)
    return function


@lru_cache(maxsize=64)
def _law(source: str, name: str, own: tuple[tuple[str, Any], ...]) -> Any:
    function = made(source, name, {**FUNCTIONS, **dict(own)}, __name__)
    whole = "|".join([source, *(str(kernel_cache.stamp_of(one)) for one in FUNCTIONS.values())])
    law = compiled(function, whole, __file__, __name__, error_model="numpy", fastmath=False, nogil=True)
    return first_class(law, np.empty(1), np.empty(1), np.empty(1), np.empty(1))
