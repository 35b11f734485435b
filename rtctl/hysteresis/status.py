"""Status bits of the inverses as plain ints, which kernels can hold: those of `EstimateStatus`."""

from __future__ import annotations

from typing import Final

from rtctl.interfaces import EstimateStatus

OK: Final = int(EstimateStatus.OK)
SATURATED: Final = int(EstimateStatus.SATURATED)
IN_GAP: Final = int(EstimateStatus.IN_GAP)
OUT_OF_RANGE: Final = int(EstimateStatus.OUT_OF_RANGE)
NOT_FINITE: Final = int(EstimateStatus.NOT_FINITE)
