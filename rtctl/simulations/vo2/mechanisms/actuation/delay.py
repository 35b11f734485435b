"""`actuation.delay`: i(t - delay)."""

from rtctl.simulations.vo2.mechanism import TYPICAL_TIME_S, Commanded, Values, Vo2Mechanism, coefficient


def late(commanded: Commanded, p: Values) -> Commanded:
    """Delay the current by `delay` [s]."""
    return commanded._replace(delay_s=commanded.delay_s + p["delay"])


MECHANISM = Vo2Mechanism(
    id="actuation.delay",
    statement="The current acts {delay} late.",
    parameters=(
        coefficient("delay", "s", "from the command to the heater", 5.0 * TYPICAL_TIME_S, low=0.0, high=10.0),
    ),
    command=late,
)
