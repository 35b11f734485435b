"""`actuation.delay`: i(t - delay)."""

from rtctl.simulations.vo2.mechanism import Commanded, Values, Vo2Mechanism, coefficient, heating_times


def late(commanded: Commanded, p: Values) -> Commanded:
    """Delay the current by `delay` [s]."""
    return commanded._replace(delay_s=commanded.delay_s + p["delay"])


MECHANISM = Vo2Mechanism(
    id="actuation.delay",
    statement="The current acts {delay} late.",
    parameters=(
        coefficient("delay", "s", "from the command to the heater", heating_times(5.0), low=0.0, high=10.0),
    ),
    command=late,
)
