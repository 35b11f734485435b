"""How many integration steps a sample needs so that the integrator is not the error.

RK4 loses (w h)^6 / 72 of an oscillation's energy a step (Hairer, Norsett, Wanner II), so over 1,000 periods
2 pi 1000 (w h)^5 / 72; 256 steps a period keep that below 1e-6.
"""

from __future__ import annotations

import math

STEPS_PER_PERIOD = 256.0
LARGEST_DAMPING_STEP = 0.5
"""damping h: RK4 is stable to 2.78, and accurate to 1e-3 here."""
MOST_SUBSTEPS = 100_000


def substeps(period_s: float, rate: float, damping: float, steps_per_period: float = STEPS_PER_PERIOD) -> int:
    """Steps between two samples `period_s` apart for the fastest pole of angular frequency `rate` [1/s].

    Raises ValueError where that is beyond reason: a parameter's unit is wrong, then.
    """
    wanted = period_s * max(rate * steps_per_period / (2.0 * math.pi), damping / LARGEST_DAMPING_STEP)
    if not wanted <= MOST_SUBSTEPS:
        raise ValueError(
            f"the model's fastest pole, {rate:.3g} rad/s with damping {damping:.3g} 1/s, would need {wanted:.3g} "
            f"steps between two samples {period_s:.3g} s apart (at most {MOST_SUBSTEPS}); check the units of its "
            "parameters"
        )
    return max(1, math.ceil(wanted - 1e-9))
