"""A function of the user's class as expressions call it: what it takes and returns, with units."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A function whose numbers are in the units that its class declares; around it all numbers are SI."""

    symbol: str
    """Name in kernels; it contains a digest of the code."""
    members: tuple[str, ...]
    """Names of the numbers that it returns."""
    member_units: tuple[str, ...]
    member_factors: tuple[float, ...]
    """SI base units of one unit of each."""
    arguments: tuple[str, ...]
    """Names of what it takes, in its order."""
    argument_units: tuple[str, ...]
    argument_factors: tuple[float, ...]
    many: Callable[[FloatArray], FloatArray] = field(compare=False, repr=False)
    """The function at many places: (arguments, n) to (members, n), in the class's units."""

    def value(self, member: str, given: Sequence[Any]) -> Any:
        """Return one of its numbers [SI] at arguments [SI] that are numbers or arrays of one shape."""
        place = self.members.index(member)
        arrays = np.broadcast_arrays(*given) if given else [np.zeros(())]
        rows = [np.ravel(one) / factor for one, factor in zip(arrays, self.argument_factors, strict=False)]
        laid = np.ascontiguousarray(rows or np.zeros((1, arrays[0].size)), dtype=np.float64)
        return self.many(laid)[place].reshape(arrays[0].shape) * self.member_factors[place]
