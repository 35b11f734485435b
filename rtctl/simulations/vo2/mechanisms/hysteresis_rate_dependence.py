"""`hysteresis.rate_dependence`: the relays follow w with time_constant w' = s - w, what is reversible follows s."""

from rtctl.simulations.vo2.mechanism import TYPICAL_TIME_S, Balance, Values, Vo2Mechanism, coefficient


def behind(balance: Balance, p: Values) -> Balance:
    """A transition that lags temperature."""
    return balance._replace(lag_s=p["time_constant"])


MECHANISM = Vo2Mechanism(
    id="hysteresis.rate_dependence",
    statement="The transition lags the film's temperature with a time constant of {time_constant}.",
    parameters=(
        coefficient(
            "time_constant", "s", "of the transition behind temperature", TYPICAL_TIME_S, low=0.0, high=10.0
        ),
    ),
    balance=behind,
)  # fmt: skip
