"""`thermal.ambient_drift`: the surrogate's power is i^2 + rate t, t since the record's first sample."""

from rtctl.simulations.vo2.mechanism import TYPICAL_POWER_MA2, Values, Vo2Mechanism, Warm, coefficient


def drifting(warm: Warm, p: Values) -> Warm:
    """The ambient warms or cools; relays that lag see it at once, as it is slow."""
    drift = p["rate"] * warm.time_s
    power = warm.power + drift
    if warm.lagging is warm.power:
        return warm._replace(power=power, lagging=power, peaks=power)
    return warm._replace(power=power, lagging=warm.lagging + drift, peaks=warm.peaks + drift)


MECHANISM = Vo2Mechanism(
    id="thermal.ambient_drift",
    statement="The ambient temperature drifts, as if the heating power grew by {rate}.",
    parameters=(
        coefficient(
            "rate", "mA^2/s", "of the surrogate's power, from each record's start",
            lambda s: 0.1 * TYPICAL_POWER_MA2 / s.duration,
        ),
    ),
    warm=drifting,
)  # fmt: skip
