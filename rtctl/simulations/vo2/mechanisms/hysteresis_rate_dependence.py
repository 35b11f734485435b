"""`hysteresis.rate_dependence`: the relays follow w with time_constant w' = s - w, what is reversible follows s.

In a film's resistance it does so in part only: loops that were identified as relays and a parabola do not part the
reversible part of the transition, which lags, from that of the pure phases, which does not.
"""

from rtctl.simulations.vo2.mechanism import TYPICAL_TIME_S, Balance, Values, Vo2Mechanism, coefficient, shape


def behind(balance: Balance, p: Values) -> Balance:
    """A transition that lags temperature."""
    return balance._replace(lag_s=p["time_constant"], lagging=p["reversible"])


MECHANISM = Vo2Mechanism(
    id="hysteresis.rate_dependence",
    statement="The transition lags the film's temperature with a time constant of {time_constant}.",
    parameters=(
        coefficient(
            "time_constant", "s", "of the transition behind temperature", 5.0 * TYPICAL_TIME_S, low=0.0, high=10.0
        ),
        shape(
            "reversible", "dimensionless", "share of what is reversible in the resistance that lags as well", 1.0,
            default=1.0, low=0.0, high=1.0, shape_range=(0.0, 1.0),
        ),
    ),
    balance=behind,
)  # fmt: skip
