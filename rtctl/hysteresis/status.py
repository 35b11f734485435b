"""Answers of the inverses: a point on a branch, and status bits as plain ints, those of `EstimateStatus`."""

from __future__ import annotations

from typing import Final, NamedTuple

from rtctl.interfaces import EstimateStatus

OK: Final = int(EstimateStatus.OK)
SATURATED: Final = int(EstimateStatus.SATURATED)
IN_GAP: Final = int(EstimateStatus.IN_GAP)
OUT_OF_RANGE: Final = int(EstimateStatus.OUT_OF_RANGE)
NOT_FINITE: Final = int(EstimateStatus.NOT_FINITE)


class BranchPoint(NamedTuple):
    """Input v that gives the output asked for; slope = dy/dv there, going on as it last moved; status bits.

    1 / slope times the noise of y is the error of v on its branch; a reversal meets the smaller reversible
    slope.
    """

    v: float
    slope: float
    status: int
